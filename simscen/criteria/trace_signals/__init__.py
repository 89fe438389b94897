"""Signals that criteria compare: their catalog, the functions that read them from a trace, and their sampling."""
