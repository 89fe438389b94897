"""Subcommands of `simscen bench` and their output."""
