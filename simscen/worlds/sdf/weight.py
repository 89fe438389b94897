"""Volumes and centres of volume, for `<inertial auto="true">` (SDF 1.11)."""

import numpy as np

from simscen.core.geometry import Array
from simscen.core.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Sphere


def volume(shape: Shape) -> float:
    """The volume of a shape in m³, whichever way the triangles of a mesh face."""
    match shape:
        case Box((x, y, z)):
            return x * y * z
        case Sphere(radius):
            return 4 / 3 * np.pi * radius**3
        case Ellipsoid((x, y, z)):
            return 4 / 3 * np.pi * x * y * z
        case Cylinder(radius, length):
            return np.pi * radius**2 * length
        case Capsule(radius, length):
            return np.pi * radius**2 * (length + 4 / 3 * radius)
        case Cone(radius, length):
            return np.pi * radius**2 * length / 3
        case Extrusion(polygon, height):
            return abs(float(_wedges(np.array(polygon))[0].sum())) * height
        case Mesh():
            return abs(float(_tetrahedra(shape)[0].sum()))


def centre(shape: Shape) -> Array:
    """The centre of volume (3,) in the shape's own frame."""
    match shape:
        case Cone(_, length):
            return np.array([0.0, 0.0, -length / 4])
        case Extrusion(polygon, height):
            areas, middles = _wedges(np.array(polygon))
            x, y = areas @ middles / areas.sum()
            return np.array([x, y, height / 2])
        case Mesh():
            volumes, middles = _tetrahedra(shape)
            total = float(volumes.sum())
            return volumes @ middles / total if abs(total) > 1e-12 else shape.vertices.mean(axis=0)
        case _:
            return np.zeros(3)


def _wedges(polygon: Array) -> tuple[Array, Array]:
    """Signed areas and centres of the triangles between the origin and each edge."""
    following = np.roll(polygon, -1, axis=0)
    areas = (polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]) / 2
    return areas, (polygon + following) / 3


def _tetrahedra(mesh: Mesh) -> tuple[Array, Array]:
    """Signed volumes and centres of the tetrahedra between the origin and each triangle (divergence theorem)."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, (a + b + c) / 4
