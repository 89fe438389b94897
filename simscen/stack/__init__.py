"""Reference navigation stack, and the protocols of stacks and their components.

This package does not import the simulator, so that it cannot use the true state.
"""
