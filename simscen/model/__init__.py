"""Specifications of scenarios, worlds, robots, and stacks: the content of YAML files as frozen, validated types."""
