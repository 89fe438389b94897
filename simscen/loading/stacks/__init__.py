"""Load stacks: stack files, Nav2 parameter files, stacks given with `--stack`, and commands of external stacks."""
