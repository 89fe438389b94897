"""What stands in the engine and never moves: all of a small world; of a large one, what something has come near to."""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry.meshes import FaceTiles, tile_faces
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim import engine
from simscen.sim.parts import parts_of

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
