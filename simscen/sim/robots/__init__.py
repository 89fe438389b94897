"""Robots in the physics engine: bases, drives and their state."""
