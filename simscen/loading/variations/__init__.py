"""From `variations:` to scenarios: paths, values, names."""
