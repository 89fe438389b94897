"""Scenarios in pytest: files as items, one for each run, and a fixture for tests in Python."""
