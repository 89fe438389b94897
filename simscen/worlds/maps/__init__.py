"""Occupancy maps: drawn from solids, read from and written to ROS map files."""
