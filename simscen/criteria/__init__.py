"""What passes: one file for each criterion, its specification and its meaning together."""
