"""Conditions of triggers, which start events and faults. Each class is both YAML specification and implementation."""
