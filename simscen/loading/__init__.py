"""Loading and checking of scenarios. YAML files become validated specifications, or problems with positions."""
