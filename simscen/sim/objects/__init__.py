"""Movable objects other than robots: scripted, pushed and deferred."""
