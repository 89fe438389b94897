"""What a scenario does to the world: one file for each action, its specification and its meaning together."""
