"""Data types and functions that all other packages use. Imports neither pydantic nor a simulation library."""
