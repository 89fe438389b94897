"""Robots from URDF files. Bullet's own reader opens any file that a URDF names, and can crash, so it is not used."""
