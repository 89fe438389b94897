"""Worlds: from files to solids, and from solids to what physics, rays and maps need."""
