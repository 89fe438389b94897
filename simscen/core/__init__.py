"""Data types and pure functions that all packages use. Needs neither pydantic nor a simulation library."""
