"""Creates the static world in the engine. A large world is created only near moving bodies, to save time."""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Vector
from simscen.core.geometry.meshes import FaceTiles, tile_faces
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim.bullet import collision_shapes, engine
from simscen.sim.scene.mesh_parts import parts_of

SMALL_WORLD_FACES = 10_000
"""Largest number of faces of a mesh that is created at once."""
TILE_SIZE_M = 4.0
"""Edge length of the square tiles in which a large mesh is created."""
EXTRA_RADIUS_M = 2.0
"""Additional radius in which `build_near` creates walls, so that later calls have nothing to do."""


class _BuiltDisc(NamedTuple):
    """Circle in m in which all walls exist in the engine."""

    x: float
    y: float
    radius: float


class Walls:
    """Static mesh in the engine. `bodies` has the ids of the created bodies.

    A large mesh is created in tiles. Unless `is_complete`, call `build_near` before a step for each body that can touch
    a wall during the step.
    """

    def __init__(self, client: int, mesh: TriangleMesh) -> None:
        self._client, self._vertices = client, mesh.vertices
        self._built: dict[int, _BuiltDisc] = {}
        """Disc of the last `build_near` for each body, by body id."""
        self._is_missing = np.zeros(0, dtype=np.bool_)
        self.bodies: list[int] = []
        if len(mesh.faces) > SMALL_WORLD_FACES:
            self._tiles = _tiles_of(mesh)
            self._is_missing = np.ones(len(self._tiles), dtype=np.bool_)
        else:
            self.bodies += engine.create_static_faces(client, mesh.vertices, mesh.faces)
        self.is_complete = not self._is_missing.any()

    def build_near(self, body_id: int, point: Vector, radius: float) -> list[int]:
        """Create the walls within `radius` m of a body at `point`; return the ids of the new walls."""
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
        bodies = [body for faces in tiles for body in engine.create_static_faces(self._client, self._vertices, faces)]
        self.bodies += bodies
        return bodies


def prepare_walls(mesh: TriangleMesh) -> None:
    """Compute and cache the parts and tiles of a static mesh. Call it in the process that forks for each run."""
    parts_of(mesh)
    if len(mesh.faces) > SMALL_WORLD_FACES:
        _tiles_of(mesh)


@cached_on_instance
def _tiles_of(mesh: TriangleMesh) -> FaceTiles:
    """Return the tiles of a mesh without the faces on the floor. The result is cached."""
    return tile_faces(mesh.vertices, collision_shapes.faces_above_floor(mesh.vertices, mesh.faces), TILE_SIZE_M)
