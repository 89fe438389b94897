"""Robots from URDF files: read by ourselves, since Bullet opens whatever a file names and crashes on what it finds."""
