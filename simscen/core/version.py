"""Which simscen this is, and where its files are: what every room can read without importing its front door."""

from pathlib import Path

__version__ = "0.1.0"

PACKAGE = Path(__file__).parents[1]
"""The folder of the package, with its shipped data."""
