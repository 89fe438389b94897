"""Pass criteria: one file for each, with its specification and its evaluation."""
