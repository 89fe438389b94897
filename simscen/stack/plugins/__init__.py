"""Checks of what stacks and components from other packages return."""
