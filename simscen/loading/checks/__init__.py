"""Semantic checks of a scenario that need no built world."""
