"""Execution of each run in a separate process: supervisor, fork server, and workers."""
