"""Faults of sensors, actuators, localizer, and map, each with its specification and implementation."""
