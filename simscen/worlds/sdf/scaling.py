"""Shapes that Gazebo Classic saved larger or smaller than their geometry says."""

from typing_extensions import assert_never

from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Sphere
from simscen.worlds.sdf.state import Scale


def scaled(shape: Shape, scale: Scale) -> Shape:
    """The shape with its sizes multiplied; what is round takes the x for its radius, as Classic does."""
    if scale == (1.0, 1.0, 1.0):
        return shape
    x, y, z = scale
    match shape:
        case Box((a, b, c)):
            return Box((a * x, b * y, c * z))
        case Cylinder(radius, length) | Capsule(radius, length) | Cone(radius, length):
            return type(shape)(radius * x, length * z)
        case Sphere(radius):
            return Sphere(radius * x)
        case Ellipsoid((a, b, c)):
            return Ellipsoid((a * x, b * y, c * z))
        case Extrusion(polygon, height):
            return Extrusion(tuple((px * x, py * y) for px, py in polygon), height * z)
        case Mesh(vertices, faces):
            return Mesh(vertices * scale, faces)
        case _:
            assert_never(shape)
