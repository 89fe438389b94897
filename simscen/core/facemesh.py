"""Faces of a mesh: some of them as a mesh of their own, and whether they are their own convex hull."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.shapes import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    Faces = npt.NDArray[np.int32]

CONVEX_FACES = 400
"""A mesh of more faces is taken as concave without a look."""
_YZX, _ZXY = (1, 2, 0), (2, 0, 1)
FLAT = 1e-6
"""m by which corners may stand out of a face of a convex mesh."""


def compact(vertices: Array, faces: Faces) -> Mesh:
    """Some faces with the vertices that they use."""
    if faces.size < len(vertices) // 8:
        used, indices = np.unique(faces, return_inverse=True)
        return Mesh(vertices[used], indices.reshape(-1, 3).astype(np.int32))
    needed = np.zeros(len(vertices), dtype=np.bool_)
    needed[faces] = True
    return Mesh(vertices[needed], (np.cumsum(needed, dtype=np.int32) - np.int32(1))[faces])


def between(vertices: Array, faces: Faces, heights: tuple[float, float]) -> Mesh:
    """Those of some faces that reach between two heights, with the vertices that they use."""
    low, high = heights
    below, above = (outside[faces] for outside in (vertices[:, 2] < low, vertices[:, 2] > high))
    beside = (below[:, 0] & below[:, 1] & below[:, 2]) | (above[:, 0] & above[:, 1] & above[:, 2])
    return compact(vertices, faces[~beside])


def is_convex(mesh: Mesh) -> bool:
    """Whether a mesh is its own convex hull; one of many faces is not even looked at."""
    if len(mesh.faces) > CONVEX_FACES:
        return False
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    u, v = b - a, c - a
    normals = u.take(_YZX, 1) * v.take(_ZXY, 1) - u.take(_ZXY, 1) * v.take(_YZX, 1)  # half of the time of `cross`
    heights = normals @ mesh.vertices.T - (normals * a).sum(axis=1)[:, None]
    lengths = np.maximum(np.sqrt((normals * normals).sum(axis=1)), 1e-12)
    return bool((heights <= FLAT * lengths[:, None]).all())
