"""Paths of a disc-shaped robot through the static world: shortest paths, clearance, narrow gaps, and passages."""
