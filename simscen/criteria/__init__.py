"""Criteria of `pass`: their specifications, and the evaluation of the trace of a run."""
