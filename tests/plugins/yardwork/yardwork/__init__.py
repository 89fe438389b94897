"""Example package with types for simscen."""
