"""Navigation stack under test. It does not import the simulator, so that it cannot use the true state."""
