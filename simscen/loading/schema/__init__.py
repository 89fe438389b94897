"""Validation of YAML trees against pydantic models. All problems are reported with their positions."""
