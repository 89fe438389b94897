"""Actions that events of a scenario perform. Each class is both the YAML specification and the implementation."""
