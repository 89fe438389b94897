"""Operations on triangle meshes: submeshes, convexity test, tiles of nearby faces, and detection of drivable solids."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Mesh, TriangleMesh

if TYPE_CHECKING:
    import numpy.typing as npt

    Faces = npt.NDArray[np.int32]
    Numbers = npt.NDArray[np.int64]
    Mask = npt.NDArray[np.bool_]

MAX_CONVEX_FACES = 400
"""Meshes with more faces are treated as concave without a test."""
_YZX, _ZXY = (1, 2, 0), (2, 0, 1)
"""Orders of coordinates in a cross product."""
CONVEX_TOLERANCE_M = 1e-6
"""Distance in m by which vertices of a convex mesh may lie outside the plane of a face."""


def submesh(vertices: Array, faces: Faces) -> Mesh:
    """Return a mesh of the given faces, with only the vertices that they use."""
    if faces.size < len(vertices) // 8:
        used, indices = np.unique(faces, return_inverse=True)
        return Mesh(vertices[used], indices.reshape(-1, 3).astype(np.int32))
    needed = np.zeros(len(vertices), dtype=np.bool_)
    needed[faces] = True
    return Mesh(vertices[needed], (np.cumsum(needed, dtype=np.int32) - np.int32(1))[faces])


def submesh_between_heights(vertices: Array, faces: Faces, heights: tuple[float, float]) -> Mesh:
    """Return a mesh of the faces that are partly between `heights`, the lowest and the highest z in m."""
    low, high = heights
    below, above = (outside[faces] for outside in (vertices[:, 2] < low, vertices[:, 2] > high))
    outside_range = (below[:, 0] & below[:, 1] & below[:, 2]) | (above[:, 0] & above[:, 1] & above[:, 2])
    return submesh(vertices, faces[~outside_range])


def is_convex(mesh: Mesh) -> bool:
    """Return whether a mesh is its own convex hull; False for meshes with more than MAX_CONVEX_FACES faces."""
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
    """Faces of a mesh, sorted into n square tiles of the plane to find those near a point quickly.

    Tile k contains `faces[starts[k]:starts[k + 1]]`. All corners of its faces lie between `low[k]` and `high[k]`, given
    as x and y in m.
    """

    faces: Faces
    starts: Numbers
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def tile(self, number: int) -> Faces:
        """Return the faces of the tile with this index."""
        return self.faces[self.starts[number] : self.starts[number + 1]]

    def near(self, x: float, y: float, within: float) -> npt.NDArray[np.bool_]:
        """Return which tiles may have a face within `within` m of the point (x, y)."""
        point = (x, y)
        outside = np.maximum(np.maximum(self.low - point, point - self.high), 0.0)
        found: npt.NDArray[np.bool_] = (outside * outside).sum(axis=1) <= within * within
        return found


def tile_faces(vertices: Array, faces: Faces, edge: float) -> FaceTiles:
    """Sort faces by their centers into square tiles of `edge` x `edge` m."""
    corners = vertices[faces, :2]
    squares = np.floor(corners.mean(axis=1) / edge)
    order = np.lexsort((squares[:, 1], squares[:, 0]))
    starts = np.flatnonzero(np.diff(squares[order], axis=0, prepend=np.nan).any(axis=1))
    if not len(starts):
        return FaceTiles(faces, np.zeros(1, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return FaceTiles(faces[order], np.r_[starts, len(order)], low, high)


FLOOR_HEIGHT_M = 0.005
"""Height up to which faces are ignored: wheels roll on the ground plane instead, which has no edges."""
MAX_SLOPE_RAD = math.radians(50)
"""Slope above which faces are walls for every robot: rubber on dry concrete (friction 1) holds up to 45°."""
SOLIDS_PER_BATCH = 64
"""Number of solids that are compared with all others at once, to limit memory."""

SolidIndices = frozenset[int]
"""Indices into `TriangleMesh.names`."""


def face_normals(mesh: TriangleMesh) -> Array:
    """Return the unit normals (n, 3) of the faces of a mesh; zeros for faces without area."""
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    crosses = np.cross(b - a, c - a)
    lengths = np.linalg.norm(crosses, axis=1, keepdims=True)
    unit: Array = crosses / np.where(lengths > 0, lengths, 1.0)
    return unit


def upward_faces(mesh: TriangleMesh, max_slope: float = MAX_SLOPE_RAD) -> Mask:
    """Return which faces are above FLOOR_HEIGHT_M, face upwards, and are at most `max_slope` rad steep."""
    top = mesh.vertices[mesh.faces, 2].max(axis=1, initial=-math.inf)
    found: Mask = (face_normals(mesh)[:, 2] >= math.cos(max_slope)) & (top > FLOOR_HEIGHT_M)
    return found


@cached_on_instance
def drivable_solids(mesh: TriangleMesh, reach: float) -> SolidIndices:
    """Return the indices of the fixed solids that wheels can roll on if they can climb steps of `reach` m.

    A solid is drivable if its upward faces begin at most `reach` m above the floor, or if their bounding box is at most
    `reach` m away from that of a drivable solid. All other solids are walls: only the hull of the robot touches them.
    """
    faces = np.flatnonzero(upward_faces(mesh))
    corners = mesh.vertices[mesh.faces[faces]]
    bottom = corners[:, :, 2].min(axis=1)
    if not (bottom <= reach).any():
        return frozenset()
    owners, solid = np.unique(mesh.owners[faces], return_inverse=True)
    low, high = np.full((len(owners), 3), math.inf), np.full((len(owners), 3), -math.inf)
    np.minimum.at(low, solid, corners.min(axis=1))
    np.maximum.at(high, solid, corners.max(axis=1))
    reached = low[:, 2] <= reach
    newly_reached: Mask = reached
    while newly_reached.any():
        adjacent = np.zeros(len(owners), dtype=np.bool_)
        for batch in np.array_split(np.flatnonzero(newly_reached), 1 + newly_reached.sum() // SOLIDS_PER_BATCH):
            apart = (low[:, None] > high[batch] + reach) | (high[:, None] + reach < low[batch])
            adjacent |= np.any(~np.any(apart, axis=2), axis=1)
        newly_reached = adjacent & ~reached
        reached = reached | adjacent
    return frozenset(owners[reached].tolist())
