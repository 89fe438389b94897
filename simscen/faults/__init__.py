"""What goes wrong with sensors and wheels: one file for each fault, its specification and its meaning together."""
