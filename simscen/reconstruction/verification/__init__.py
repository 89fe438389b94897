"""Compares a run of the reconstructed scenario with the log, and creates the page that shows both."""
