"""Shared data types and pure functions. Imports neither pydantic nor an engine."""
