"""Probable causes of failed criteria, from the trace and the scenario."""
