"""The navigation stack under test. It cannot see the truth: nothing here imports the simulator."""
