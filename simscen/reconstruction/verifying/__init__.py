"""Comparison of a run of the reconstructed scenario with the log, and the page that shows both."""
