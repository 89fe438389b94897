"""Trigger conditions, which start events. Each class is both the YAML specification and the implementation."""
