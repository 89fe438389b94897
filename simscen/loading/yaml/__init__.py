"""YAML files as trees whose nodes know their position in the file."""
