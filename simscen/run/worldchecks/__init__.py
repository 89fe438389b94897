"""Semantic checks of a scenario in its built world."""
