"""Scenarios in pytest: files as items, one for each run, and a fixture for tests in Python."""

OUT_OPTION = "simscen_out"
"""Name of the setting for the output folder: in the configuration, and in the input of xdist workers."""
