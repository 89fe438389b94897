"""Building blocks of specifications: strict pydantic models, quantities with units, single-key choices."""
