"""Judgment of a run by its trace (recorded states and events): verdicts, metrics, causes of failures, and result."""
