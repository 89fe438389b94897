"""From a path to velocities."""
