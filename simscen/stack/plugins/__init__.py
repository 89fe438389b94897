"""Checks of the answers of stacks and components that come from other packages."""
