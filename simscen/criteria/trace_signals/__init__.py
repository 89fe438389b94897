"""Signals that criteria compare: their definitions, their readers, and their sampling."""
