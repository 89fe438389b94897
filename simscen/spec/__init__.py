"""How specifications are written: strict pydantic models, quantities with units, single-key choices."""
