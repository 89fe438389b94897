"""Creates the contents of the reconstructed scenario (world, robot, goals, criteria) and its YAML text."""
