"""Import of Gazebo worlds: SDF 1.3 to 1.12 is converted to the shapes that physics, ray casting and maps share."""

from simscen.worlds.sdf.load import load_sdf

__all__ = ["load_sdf"]
