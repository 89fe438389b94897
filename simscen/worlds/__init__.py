"""Worlds: read from files as solids, and converted to meshes, ray scenes, and maps."""
