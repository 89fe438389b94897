"""Validation of the results of stacks and of their components from other packages."""
