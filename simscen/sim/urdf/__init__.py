"""Robots from URDF files. Bullet's own reader is not used: it opens any file that a URDF names and can crash."""
