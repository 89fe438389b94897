"""Gazebo worlds: SDF 1.3 to 1.12 read into the shapes that physics, rays and map share."""

from simscen.worlds.sdf.load import load_sdf

__all__ = ["load_sdf"]
