"""Version of simscen and location of its files."""

from pathlib import Path

__version__ = "0.1.0"

PACKAGE = Path(__file__).parents[1]
"""Folder of the Python package, which contains the shipped data."""
