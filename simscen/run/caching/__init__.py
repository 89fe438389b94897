"""Caches of worlds and prepared scenarios, in memory and on disk."""
