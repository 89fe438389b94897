"""Operations on triangle meshes: submeshes, convexity, search for nearby faces, and solids that a robot can climb.

`vertices` are (n, 3) in m. `faces` are (m, 3) indices of vertices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Mesh, TriangleMesh

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    Faces = npt.NDArray[np.int32]
    Indices = npt.NDArray[np.int64]
    Mask = npt.NDArray[np.bool_]

MAX_CONVEX_FACES = 400
"""Maximum number of faces of a mesh that `is_convex` tests."""
_YZX, _ZXY = (1, 2, 0), (2, 0, 1)
"""Orders of the coordinates in the two products of a cross product."""
CONVEX_TOLERANCE_M = 1e-6
"""Maximum distance by which a vertex of a convex mesh may lie outside the plane of a face."""


def submesh(vertices: Array, faces: Faces) -> Mesh:
    """Return a mesh of these faces, without unused vertices."""
    if faces.size < len(vertices) // 8:  # faster for few faces
        used_indices, indices = np.unique(faces, return_inverse=True)
        return Mesh(vertices[used_indices], indices.reshape(-1, 3).astype(np.int32))
    is_used = np.zeros(len(vertices), dtype=np.bool_)
    is_used[faces] = True
    return Mesh(vertices[is_used], (np.cumsum(is_used, dtype=np.int32) - np.int32(1))[faces])


def concatenate_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Return one mesh with the triangles of all meshes, which must have the same frame."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + np.int32(start) for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def submesh_between_heights(vertices: Array, faces: Faces, heights: tuple[float, float]) -> Mesh:
    """Return a mesh of the faces that are not entirely below or above `heights`: minimum and maximum z in m."""
    low, high = heights
    below, above = (outside[faces] for outside in (vertices[:, 2] < low, vertices[:, 2] > high))
    outside_range = (below[:, 0] & below[:, 1] & below[:, 2]) | (above[:, 0] & above[:, 1] & above[:, 2])
    return submesh(vertices, faces[~outside_range])


def is_convex(mesh: Mesh) -> bool:
    """Return whether a mesh is convex; False for meshes with more than MAX_CONVEX_FACES faces."""
    if len(mesh.faces) > MAX_CONVEX_FACES:
        return False
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    u, v = b - a, c - a
    normals = u.take(_YZX, 1) * v.take(_ZXY, 1) - u.take(_ZXY, 1) * v.take(_YZX, 1)  # takes half the time of np.cross
    heights = normals @ mesh.vertices.T - (normals * a).sum(axis=1)[:, None]
    lengths = np.maximum(np.sqrt((normals * normals).sum(axis=1)), 1e-12)
    return bool((heights <= CONVEX_TOLERANCE_M * lengths[:, None]).all())


@dataclass(frozen=True, eq=False)
class FaceTiles:
    """Faces of a mesh, grouped by square tiles of the xy plane for a fast search for nearby faces.

    The faces of tile k are `faces[starts[k]:starts[k + 1]]`. Their bounding box extends from `low[k]` to `high[k]`,
    given as (x, y) in m.
    """

    faces: Faces
    starts: Indices
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def tile(self, index: int) -> Faces:
        """Return the faces of a tile."""
        return self.faces[self.starts[index] : self.starts[index + 1]]

    def near(self, x: float, y: float, distance: float) -> npt.NDArray[np.bool_]:
        """Return a mask of the tiles whose bounding box is at most `distance` m away from the point (x, y)."""
        point = (x, y)
        outside = np.maximum(np.maximum(self.low - point, point - self.high), 0.0)
        found: npt.NDArray[np.bool_] = (outside * outside).sum(axis=1) <= distance * distance
        return found


def tile_faces(vertices: Array, faces: Faces, tile_size: float) -> FaceTiles:
    """Group faces by square tiles of `tile_size` m. The center of a face determines its tile."""
    corners = vertices[faces, :2]
    squares = np.floor(corners.mean(axis=1) / tile_size)
    order = np.lexsort((squares[:, 1], squares[:, 0]))
    starts = np.flatnonzero(np.diff(squares[order], axis=0, prepend=np.nan).any(axis=1))
    if not len(starts):
        return FaceTiles(faces, np.zeros(1, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return FaceTiles(faces[order], np.r_[starts, len(order)], low, high)


FLOOR_HEIGHT_M = 0.005
"""Faces of which no point is higher than this belong to the floor."""
MAX_SLOPE_RAD = math.radians(50)
"""Maximum slope of faces on which wheels can roll. Steeper faces are walls."""
SOLIDS_PER_BATCH = 64
"""Number of solids that `drivable_solids` compares with all other solids at once, to limit the memory."""

SolidIndices = frozenset[int]
"""Indices into `TriangleMesh.names`."""


def face_normals(mesh: TriangleMesh) -> Array:
    """Return the unit normals (n, 3) of the faces of a mesh; zeros for faces without area."""
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    crosses = np.cross(b - a, c - a)
    lengths = np.linalg.norm(crosses, axis=1, keepdims=True)
    unit: Array = crosses / np.where(lengths > 0, lengths, 1.0)
    return unit


def upward_faces(mesh: TriangleMesh) -> Mask:
    """Return a mask of the upward faces that are at most MAX_SLOPE_RAD steep and do not belong to the floor."""
    top = mesh.vertices[mesh.faces, 2].max(axis=1, initial=-math.inf)
    found: Mask = (face_normals(mesh)[:, 2] >= math.cos(MAX_SLOPE_RAD)) & (top > FLOOR_HEIGHT_M)
    return found


@cached_on_instance
def drivable_solids(mesh: TriangleMesh, max_step: float) -> SolidIndices:
    """Return the indices of the solids onto which a robot can drive if its wheels climb steps of `max_step` m.

    Each solid is represented by the bounding box of its upward faces. The robot can drive onto a solid if the bottom of
    this box is at most `max_step` m above z = 0, or if the box is at most `max_step` m along each axis from the box of
    another solid onto which it can drive.
    """
    faces = np.flatnonzero(upward_faces(mesh))
    corners = mesh.vertices[mesh.faces[faces]]
    bottom = corners[:, :, 2].min(axis=1)
    if not (bottom <= max_step).any():
        return frozenset()
    owners, solid = np.unique(mesh.owners[faces], return_inverse=True)
    low, high = np.full((len(owners), 3), math.inf), np.full((len(owners), 3), -math.inf)
    np.minimum.at(low, solid, corners.min(axis=1))
    np.maximum.at(high, solid, corners.max(axis=1))
    reached = low[:, 2] <= max_step
    newly_reached: Mask = reached
    while newly_reached.any():
        adjacent = np.zeros(len(owners), dtype=np.bool_)
        for batch in np.array_split(np.flatnonzero(newly_reached), 1 + newly_reached.sum() // SOLIDS_PER_BATCH):
            apart = (low[:, None] > high[batch] + max_step) | (high[:, None] + max_step < low[batch])
            adjacent |= np.any(~np.any(apart, axis=2), axis=1)
        newly_reached = adjacent & ~reached
        reached = reached | adjacent
    return frozenset(owners[reached].tolist())
