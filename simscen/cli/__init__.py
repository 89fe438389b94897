"""Command-line interface `simscen`: entry point, commands, sessions, benchmarks, and generated reference pages."""
