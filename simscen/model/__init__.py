"""One frozen, validated description of a run: what the YAML files say, as types."""
