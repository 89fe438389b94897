"""Metrics of every run and statistics of a session."""
