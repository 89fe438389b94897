"""Signal temporal logic: conditions on signals over time, their robustness, and their description in words."""
