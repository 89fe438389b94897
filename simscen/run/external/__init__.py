"""A stack in a process of its own: what its name runs, how it is started, spoken with, and ended."""
