"""What is measured of every run and every session."""
