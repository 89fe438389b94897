"""Expand the section `variations:` of a scenario to one scenario for each combination of values."""
