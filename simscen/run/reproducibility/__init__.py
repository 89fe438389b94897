"""What a result depends on, and whether two runs agree."""
