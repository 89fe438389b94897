"""Scans beside the static world: which beams it explains, clusters of those that it does not, and maps from scans."""
