"""Subcommands of `simscen bench`, and the output of their results as tables and JSON."""
