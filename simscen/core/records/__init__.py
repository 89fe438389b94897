"""Records of runs and sessions: trace, events, verdicts, results, and studies."""
