"""A run: assembled from a scenario, stepped in lockstep, one process each."""
