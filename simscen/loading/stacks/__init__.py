"""Stacks: stack files, Nav2 parameter files, the option `--stack`, and commands of external stacks."""
