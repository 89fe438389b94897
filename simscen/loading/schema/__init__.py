"""Validate a YAML tree against a pydantic model and report every problem with its position."""
