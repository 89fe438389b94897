"""simscen: declarative, deterministic scenario tests for mobile-robot navigation."""

__version__ = "0.1.0"
