"""Volumes and centres of volume, for `<inertial auto="true">` (SDF 1.11)."""

import numpy as np

from simscen.core.geometry import Array
from simscen.core.shapes import Shape
from simscen.worlds.meshing import triangulate


def volume_and_centre(shape: Shape) -> tuple[float, Array]:
    """The volume in m³ inside a shape's triangles and its centre (3,) in the shape's frame.

    By the divergence theorem: signed tetrahedra between the origin and each triangle. An open mesh has no inside;
    its volume is then what the tetrahedra happen to add up to, as in sdformat's own mesh calculator.
    """
    mesh = triangulate(shape)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    total = float(volumes.sum())
    if abs(total) < 1e-12:
        return 0.0, mesh.vertices.mean(axis=0)
    return abs(total), volumes @ (a + b + c) / 4 / total
