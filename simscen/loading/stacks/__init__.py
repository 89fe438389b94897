"""Stacks: stack files, Nav2 parameter files, stacks chosen on the command line, and commands of external stacks."""
