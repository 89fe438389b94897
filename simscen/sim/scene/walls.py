"""Static world in the engine, built near moving bodies only if it is large, and its split into parts."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Vector
from simscen.core.geometry.meshes import MAX_CONVEX_FACES, FaceTiles, tile_faces
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim.bullet import engine

SMALL_WORLD_FACES = 10_000
"""Number of faces up to which the whole mesh is built at once, which takes 30 ms."""
TILE_SIZE_M = 4.0
"""Edge length of the square tiles into which large meshes are split."""
EXTRA_RADIUS_M = 2.0
"""Additional radius in which walls are built, so that the next calls have nothing to do."""

Indices = npt.NDArray[np.int64]


class _BuiltDisc(NamedTuple):
    """All walls within `radius` m of a point are built."""

    x: float
    y: float
    radius: float


class Walls:
    """Static mesh as bodies of the engine, with the ids `bodies`.

    The engine needs 3 µs to build each face, 0.7 s for a map of 100 x 100 m, and searches all of them at each step.
    Therefore a large mesh is built in tiles: `build_near` must be called for all that can touch a wall in a step.
    """

    def __init__(self, client: int, mesh: TriangleMesh) -> None:
        self._client, self._vertices = client, mesh.vertices
        self._built: dict[int, _BuiltDisc] = {}
        self._is_missing = np.zeros(0, dtype=np.bool_)
        self.bodies: list[int] = []
        if len(mesh.faces) > SMALL_WORLD_FACES:
            self._tiles = _tiles_of(mesh)
            self._is_missing = np.ones(len(self._tiles), dtype=np.bool_)
        else:
            self.bodies += engine.static_mesh(client, mesh)
        self.is_complete = not self._is_missing.any()

    def build_near(self, body_id: int, point: Vector, radius: float) -> list[int]:
        """Build the walls within `radius` m of the position of a body; return the ids of the new walls."""
        x, y, _ = point
        built = self._built.get(body_id)
        if built is not None and math.hypot(x - built.x, y - built.y) + radius <= built.radius:
            return []
        radius += EXTRA_RADIUS_M
        self._built[body_id] = _BuiltDisc(x, y, radius)
        new = np.flatnonzero(self._is_missing & self._tiles.near(x, y, radius))
        self._is_missing[new] = False
        self.is_complete = not self._is_missing.any()
        tiles = (self._tiles.tile(index) for index in new.tolist())
        bodies = [body for faces in tiles for body in engine.static_faces(self._client, self._vertices, faces)]
        self.bodies += bodies
        return bodies


def prepare_walls(mesh: TriangleMesh) -> None:
    """Compute in advance what all runs in a world need to know of its static mesh."""
    parts_of(mesh)
    if len(mesh.faces) > SMALL_WORLD_FACES:
        _tiles_of(mesh)


@cached_on_instance
def _tiles_of(mesh: TriangleMesh) -> FaceTiles:
    return tile_faces(mesh.vertices, engine.above_floor(mesh.vertices, mesh.faces), TILE_SIZE_M)


@dataclass(frozen=True, eq=False)
class MeshParts:
    """Split of a static mesh into parts, so that a distance query can skip a whole part.

    Part k has the faces `order[starts[k]:starts[k + 1]]` of the solid `owners[k]`; parts are sorted by owner. `low` and
    `high` are the corners (n, 3) of their bounding boxes. A solid with few faces, which may be convex, is one part.
    """

    order: Indices
    starts: Indices
    owners: Indices
    low: Array
    high: Array

    def faces(self, part: int) -> Indices:
        """Return the face indices of a part."""
        return self.order[self.starts[part] : self.starts[part + 1]]

    def is_whole_solid(self, part: int) -> bool:
        """Return whether a part is all of its solid."""
        return len(self.of_owner(int(self.owners[part]))) == 1

    def of_owner(self, owner: int) -> range:
        """Return the parts of a solid."""
        first, last = np.searchsorted(self.owners, (owner, owner + 1)).tolist()
        return range(first, last)

    def faces_of_owner(self, owner: int) -> Indices:
        """Return the face indices of a whole solid."""
        parts = self.of_owner(owner)
        return self.order[self.starts[parts.start] : self.starts[parts.stop]]

    def owners_around(self, point: Vector) -> list[int]:
        """Return the solids whose bounding box contains a point."""
        owners, first = np.unique(self.owners, return_index=True)
        if not len(owners):
            return []
        low, high = np.minimum.reduceat(self.low, first), np.maximum.reduceat(self.high, first)
        found: list[int] = owners[((low <= point) & (point <= high)).all(axis=1)].tolist()
        return found


@cached_on_instance
def parts_of(mesh: TriangleMesh) -> MeshParts:
    """Return the parts of a mesh."""
    corners = mesh.vertices[mesh.faces]
    is_large = np.bincount(mesh.owners, minlength=len(mesh.names))[mesh.owners] > MAX_CONVEX_FACES
    tiles = np.where(is_large[:, None], np.floor(corners[:, :, :2].mean(axis=1) / TILE_SIZE_M), 0.0)
    order = np.lexsort((tiles[:, 1], tiles[:, 0], mesh.owners))
    keys = np.column_stack((mesh.owners, tiles))[order]
    starts = np.flatnonzero(np.r_[True, (keys[1:] != keys[:-1]).any(axis=1)]) if len(keys) else np.zeros(0, np.int64)
    low, high = np.empty((0, 3)), np.empty((0, 3))
    if len(keys):
        low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
        high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    owners = mesh.owners[order[starts]].astype(np.int64)
    return MeshParts(order.astype(np.int64), np.r_[starts, len(keys)].astype(np.int64), owners, low, high)
