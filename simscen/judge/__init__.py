"""Criteria × trace → verdicts, metrics and the result of a run. Needs a log, never a simulator."""
