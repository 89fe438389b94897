"""Studies: what many runs together say, and the generated worlds they drive in. Knows no simulator."""
