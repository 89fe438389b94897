"""Edits of single values of a YAML text that preserve every other character, such as comments and line breaks."""
