"""Import Gazebo worlds (SDF versions 1.3 to 1.12) as the shapes that physics, ray casting and maps use."""

from simscen.worlds.sdf.load import load_sdf

__all__ = ["load_sdf"]
