"""Conversion of imported worlds to simscen's own world files."""
