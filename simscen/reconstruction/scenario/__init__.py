"""Contents of the reconstructed scenario: world, robot, goals, criteria, and the text with its reason."""
