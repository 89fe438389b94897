"""Contract tests for everybody's own components."""
