"""What a run records: trace, events, verdicts, results and session events."""
