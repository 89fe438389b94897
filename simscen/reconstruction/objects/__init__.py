"""Objects that the scans show and the map does not: clusters, tracks, shapes, and poses over time."""
