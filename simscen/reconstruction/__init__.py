"""Reconstruction of scenarios from recorded drives: poses, goals, obstacles, and sensor faults from a log."""
