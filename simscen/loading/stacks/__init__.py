"""Stack files, stacks chosen on the command line, and commands of external stacks."""
