"""Changes of single values of a YAML text that leave every other character as it is."""
