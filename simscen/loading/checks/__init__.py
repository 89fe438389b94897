"""Semantic checks of scenarios and other files: as written, and in the built world."""
