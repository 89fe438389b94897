"""Load and check scenarios: YAML files to validated models and built worlds, or problems with positions and hints."""
