"""Variations: expansion of a scenario with `variations` to one scenario for each combination of values."""
