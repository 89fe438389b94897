"""YAML files as trees with the positions of keys and values."""
