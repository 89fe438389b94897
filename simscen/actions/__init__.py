"""Actions that events of a scenario perform on the world, each with its specification and implementation."""
