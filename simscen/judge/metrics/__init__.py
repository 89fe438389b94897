"""Metrics of every run, statistics of a session, and comparisons of stacks or sessions."""
