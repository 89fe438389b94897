"""Checks of a robot's file: its geometry, and a trial drive in an empty world."""
