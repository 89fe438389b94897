"""Shortest paths, clearance and passages of a disc in the static world."""
