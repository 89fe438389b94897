"""Lazy Theta* for simscen."""
