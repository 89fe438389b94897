"""Ground truth of collisions and clearance."""
