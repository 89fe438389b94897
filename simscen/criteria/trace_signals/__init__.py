"""Signals (quantities over time) of a recorded run: catalog, functions that compute them, and sampling."""
