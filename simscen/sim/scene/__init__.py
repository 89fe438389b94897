"""Static world, ground and camera images."""
