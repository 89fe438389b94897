"""Judges a run by its log: evaluates criteria, computes metrics, and builds the result. Needs no simulator."""
