"""What stands in the engine and never moves: all of a small world; of a large one, what something has come near to."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.remembered import remembered
from simscen.core.shapes import TriangleMesh
from simscen.sim import engine
from simscen.sim.parts import parts_of

FEW = 10_000
"""Faces that the engine takes in 30 ms, at once."""
EDGE = 4.0
"""m of the squares that others are taken in."""
AHEAD = 2.0
"""m beyond what was asked for within which walls are put up too, so that one need not ask again at once."""

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class _Lots:
    """`faces[starts[k]:starts[k + 1]]` lie in a square; `low` and `high` are the corners (n, 2) around them."""

    faces: engine.Faces
    starts: npt.NDArray[np.int64]
    low: Array
    high: Array


class _Looked(NamedTuple):
    """All walls within `far` metres of a place stand."""

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
            self._missing = np.ones(len(self._lots.starts) - 1, dtype=np.bool_)
        else:
            self.bodies += engine.static_mesh(client, mesh)
        self.complete = not self._missing.any()

    def near(self, number: int, place: Vector, within: float) -> list[int]:
        """Put up the walls within so many metres of a place where a body is now, by its number: their numbers."""
        x, y, _ = place
        known = self._looked.get(number)
        if known is not None and math.hypot(x - known.x, y - known.y) + within <= known.far:
            return []
        far = within + AHEAD
        self._looked[number] = _Looked(x, y, far)
        outside = np.maximum(np.maximum(self._lots.low - (x, y), (x, y) - self._lots.high), 0.0)
        fresh = np.flatnonzero(self._missing & (np.hypot(*outside.T) <= far))
        self._missing[fresh] = False
        self.complete = not self._missing.any()
        bodies = [body for lot in fresh.tolist() for body in self._built(lot)]
        self.bodies += bodies
        return bodies

    def _built(self, lot: int) -> list[int]:
        faces = self._lots.faces[self._lots.starts[lot] : self._lots.starts[lot + 1]]
        return engine.static_faces(self._client, self._vertices, faces)


def ready(mesh: TriangleMesh) -> None:
    """Work out now what runs in a world need to know of its walls."""
    parts_of(mesh)
    if len(mesh.faces) > FEW:
        _lots_of(mesh)


@remembered
def _lots_of(mesh: TriangleMesh) -> _Lots:
    faces = engine.above_floor(mesh.vertices, mesh.faces)
    corners = mesh.vertices[faces, :2]
    squares = np.floor(corners.mean(axis=1) / EDGE)
    order = np.lexsort((squares[:, 1], squares[:, 0]))
    starts = np.flatnonzero(np.diff(squares[order], axis=0, prepend=np.nan).any(axis=1))
    if not len(starts):
        return _Lots(faces, np.zeros(1, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return _Lots(faces[order], np.r_[starts, len(order)], low, high)
