"""Reads a recorded drive from a log: its messages as arrays, its goals, and the description in the log header."""
