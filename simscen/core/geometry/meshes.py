"""Parts of triangle meshes: submeshes, convexity, and square tiles of faces for lookup by position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    Faces = npt.NDArray[np.int32]
    Numbers = npt.NDArray[np.int64]

MAX_CONVEX_FACES = 400
"""A mesh of more faces is taken as concave without a look."""
_YZX, _ZXY = (1, 2, 0), (2, 0, 1)
CONVEX_TOLERANCE_M = 1e-6
"""m by which corners may stand out of a face of a convex mesh."""


def submesh(vertices: Array, faces: Faces) -> Mesh:
    """Some faces with the vertices that they use."""
    if faces.size < len(vertices) // 8:
        used, indices = np.unique(faces, return_inverse=True)
        return Mesh(vertices[used], indices.reshape(-1, 3).astype(np.int32))
    needed = np.zeros(len(vertices), dtype=np.bool_)
    needed[faces] = True
    return Mesh(vertices[needed], (np.cumsum(needed, dtype=np.int32) - np.int32(1))[faces])


def submesh_between_heights(vertices: Array, faces: Faces, heights: tuple[float, float]) -> Mesh:
    """Those of some faces that reach between two heights, with the vertices that they use."""
    low, high = heights
    below, above = (outside[faces] for outside in (vertices[:, 2] < low, vertices[:, 2] > high))
    beside = (below[:, 0] & below[:, 1] & below[:, 2]) | (above[:, 0] & above[:, 1] & above[:, 2])
    return submesh(vertices, faces[~beside])


def is_convex(mesh: Mesh) -> bool:
    """Whether a mesh is its own convex hull; one of many faces is not even looked at."""
    if len(mesh.faces) > MAX_CONVEX_FACES:
        return False
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    u, v = b - a, c - a
    normals = u.take(_YZX, 1) * v.take(_ZXY, 1) - u.take(_ZXY, 1) * v.take(_YZX, 1)  # half of the time of `cross`
    heights = normals @ mesh.vertices.T - (normals * a).sum(axis=1)[:, None]
    lengths = np.maximum(np.sqrt((normals * normals).sum(axis=1)), 1e-12)
    return bool((heights <= CONVEX_TOLERANCE_M * lengths[:, None]).all())


@dataclass(frozen=True, eq=False)
class FaceTiles:
    """`faces[starts[k]:starts[k + 1]]` are lot k; `low` and `high` are the corners (n, 2) around it."""

    faces: Faces
    starts: Numbers
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def lot(self, number: int) -> Faces:
        """The faces of a lot."""
        return self.faces[self.starts[number] : self.starts[number + 1]]

    def near(self, x: float, y: float, within: float) -> npt.NDArray[np.bool_]:
        """Which lots may have anything within so many meters of a place."""
        place = (x, y)
        outside = np.maximum(np.maximum(self.low - place, place - self.high), 0.0)
        found: npt.NDArray[np.bool_] = (outside * outside).sum(axis=1) <= within * within
        return found


def tile_faces(vertices: Array, faces: Faces, edge: float) -> FaceTiles:
    """Faces by the square with an edge of so many meters that their middle lies in."""
    corners = vertices[faces, :2]
    squares = np.floor(corners.mean(axis=1) / edge)
    order = np.lexsort((squares[:, 1], squares[:, 0]))
    starts = np.flatnonzero(np.diff(squares[order], axis=0, prepend=np.nan).any(axis=1))
    if not len(starts):
        return FaceTiles(faces, np.zeros(1, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return FaceTiles(faces[order], np.r_[starts, len(order)], low, high)
