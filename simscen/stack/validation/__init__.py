"""Validation of the results of stack components and of whole stacks, in particular of those from other packages."""
