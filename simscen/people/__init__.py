"""People: the social force model, and how they take a robot. Knows nothing but the core."""
