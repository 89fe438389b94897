"""When something happens: one file for each condition, its specification and its meaning together."""
