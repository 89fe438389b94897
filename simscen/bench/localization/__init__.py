"""Logs of the kind that AMCL is tried on, made up: buildings, what moves in them, raw wheels and a lidar on a base."""
