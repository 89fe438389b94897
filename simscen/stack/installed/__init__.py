"""The door through which components come into a stack, and what watches them there."""
