"""What stands in the engine and never moves: all of a small world; of a large one, what something has come near to."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array
from simscen.core.geometry.meshes import MAX_CONVEX_FACES, FaceTiles, tile_faces
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim.bullet import engine

FEW = 10_000
"""Faces that the engine takes in 30 ms, at once."""
EDGE = 4.0
"""m of the squares that others are taken in."""
AHEAD = 2.0
"""m beyond what was asked for within which walls are put up too, so that one need not ask again at once."""

Vector = tuple[float, float, float]


class _Looked(NamedTuple):
    """All walls within `far` meters of a place stand."""

    x: float
    y: float
    far: float


class Walls:
    """A static mesh as bodies of the engine, numbers `bodies`.

    The engine takes 3 µs for each face, 0.7 s for a map of 100 x 100 m, and looks through all of them at each step.
    Whoever lets it step sees to it that `near` was asked about everything that can touch a wall in that step.
    """

    def __init__(self, client: int, mesh: TriangleMesh) -> None:
        self._client, self._vertices = client, mesh.vertices
        self._looked: dict[int, _Looked] = {}
        self._missing = np.zeros(0, dtype=np.bool_)
        self.bodies: list[int] = []
        if len(mesh.faces) > FEW:
            self._lots = _lots_of(mesh)
            self._missing = np.ones(len(self._lots), dtype=np.bool_)
        else:
            self.bodies += engine.static_mesh(client, mesh)
        self.complete = not self._missing.any()

    def near(self, number: int, place: Vector, within: float) -> list[int]:
        """Put up the walls within so many meters of a place where a body is now, by its number: their numbers."""
        x, y, _ = place
        known = self._looked.get(number)
        if known is not None and math.hypot(x - known.x, y - known.y) + within <= known.far:
            return []
        far = within + AHEAD
        self._looked[number] = _Looked(x, y, far)
        fresh = np.flatnonzero(self._missing & self._lots.near(x, y, far))
        self._missing[fresh] = False
        self.complete = not self._missing.any()
        lots = (self._lots.tile(number) for number in fresh.tolist())
        bodies = [body for faces in lots for body in engine.static_faces(self._client, self._vertices, faces)]
        self.bodies += bodies
        return bodies


def ready(mesh: TriangleMesh) -> None:
    """Work out now what runs in a world need to know of its walls."""
    parts_of(mesh)
    if len(mesh.faces) > FEW:
        _lots_of(mesh)


@cached_on_instance
def _lots_of(mesh: TriangleMesh) -> FaceTiles:
    return tile_faces(mesh.vertices, engine.above_floor(mesh.vertices, mesh.faces), EDGE)


# A static mesh split into parts, so that distance checks can skip a whole part.
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshParts:
    """Faces `order[starts[k]:starts[k + 1]]` are part k, which belongs to `owners[k]`; parts are sorted by owner.

    `low` and `high` are the corners (n, 3) of each part. One of few faces, which may be convex, is one part.
    """

    order: Indices
    starts: Indices
    owners: Indices
    low: Array
    high: Array

    def faces(self, part: int) -> Indices:
        """The faces of a part, by number."""
        return self.order[self.starts[part] : self.starts[part + 1]]

    def whole(self, part: int) -> bool:
        """Whether a part is all of its solid."""
        return len(self.of(int(self.owners[part]))) == 1

    def of(self, owner: int) -> range:
        """The parts of a solid."""
        first, last = np.searchsorted(self.owners, (owner, owner + 1)).tolist()
        return range(first, last)

    def faces_of(self, owner: int) -> Indices:
        """The faces of a whole solid, by number."""
        parts = self.of(owner)
        return self.order[self.starts[parts.start] : self.starts[parts.stop]]

    def holding(self, place: tuple[float, float, float]) -> list[int]:
        """The solids whose extents a place lies in."""
        filled, first = np.unique(self.owners, return_index=True)
        if not len(filled):
            return []
        low, high = np.minimum.reduceat(self.low, first), np.maximum.reduceat(self.high, first)
        found: list[int] = filled[((low <= place) & (place <= high)).all(axis=1)].tolist()
        return found


@cached_on_instance
def parts_of(mesh: TriangleMesh) -> MeshParts:
    """The parts of a mesh."""
    corners = mesh.vertices[mesh.faces]
    large = np.bincount(mesh.owners, minlength=len(mesh.names))[mesh.owners] > MAX_CONVEX_FACES
    tiles = np.where(large[:, None], np.floor(corners[:, :, :2].mean(axis=1) / EDGE), 0.0)
    order = np.lexsort((tiles[:, 1], tiles[:, 0], mesh.owners))
    keys = np.column_stack((mesh.owners, tiles))[order]
    starts = np.flatnonzero(np.r_[True, (keys[1:] != keys[:-1]).any(axis=1)]) if len(keys) else np.zeros(0, np.int64)
    low, high = np.empty((0, 3)), np.empty((0, 3))
    if len(keys):
        low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
        high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    owners = mesh.owners[order[starts]].astype(np.int64)
    return MeshParts(order.astype(np.int64), np.r_[starts, len(keys)].astype(np.int64), owners, low, high)
