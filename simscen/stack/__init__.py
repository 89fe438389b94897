"""Reference navigation stack, and the protocols of stacks and their components.

This package does not import the simulator. A stack gets all data as sensor readings.
"""
