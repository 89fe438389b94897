"""Planners that Nav2 does not have."""
