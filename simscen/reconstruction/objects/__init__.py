"""Objects that the scans show and the map does not: tracks, shapes, and poses over time."""
