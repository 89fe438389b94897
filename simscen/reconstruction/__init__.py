"""Reconstructs scenarios from recorded drives: goals, objects, faults, and criteria from a log."""
