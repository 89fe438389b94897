"""Judgment of a run by its trace: verdicts of criteria, metrics, likely causes, and the result. Needs no simulator."""
