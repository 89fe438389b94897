"""Load YAML files as validated scenarios, or report every problem with its position and a hint."""
