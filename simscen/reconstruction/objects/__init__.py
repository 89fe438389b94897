"""Finds objects that the scans show and the map does not: clusters, tracks, shapes, and pedestrians."""
