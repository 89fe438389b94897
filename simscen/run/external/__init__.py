"""External stacks: navigation stacks in processes of their own that use the stack protocol."""
