"""Signal temporal logic (STL): conditions on signals over time, their robustness, and their description as text."""
