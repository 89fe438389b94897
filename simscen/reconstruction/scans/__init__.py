"""Scans beside the static world: which beams it explains, and maps from scans."""
