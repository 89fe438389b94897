"""Shortest ways and maps of worlds, kept between sessions: they are what takes longest to prepare.

For a house, the ways to the goals take 50 to 250 ms and the map 4, to read both takes 1; of a map of 100 x 100 m or a
warehouse of 5000 objects, 0.5 to 0.7 s and 0.4 s against 30 ms, most of which goes into the key. Solids are fused in
1 to 2 ms (150 ms in the large ones), which is less than to look whether that is known; meshes are read anew.
"""

import hashlib
import struct
from collections.abc import Sequence
from functools import cache

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.navigation import Goal
from simscen.run.keptfiles import KeptFiles
from simscen.run.versions import arithmetic, code, versions
from simscen.worlds.build import build
from simscen.worlds.mapsize import RESOLUTION
from simscen.worlds.meshing import fuse
from simscen.worlds.shortest import Leg, legs_between
from simscen.worlds.slicing import map_of

_LEGS = TypeAdapter(list[Leg])
_MAP = struct.Struct("<II4d")
_ROOMS = ("core", "worlds", "ways")
"""Where the code is that the results depend on."""


class KeptWorlds:
    """Works out what `build` and `legs_between` do, or knows it. Equal worlds give equal results, to the last bit."""

    def __init__(self, files: KeptFiles) -> None:
        self._files = files

    def build(self, world: World, lidar_height: float) -> BuiltWorld:
        """See worlds.build."""
        if not self._files.on:
            return build(world, lidar_height)
        mesh = fuse(world.solids)
        places = [tuple(pose) for pose in world.places.values()]
        grid = world.grid and (world.grid.cells, world.grid.resolution, world.grid.origin)
        key = key_of("map", _surface(mesh), world.bounds, places, grid, lidar_height, RESOLUTION)
        known = _map_of_bytes(self._files.get(key))
        if known is None:
            known = map_of(world, mesh, lidar_height)
            self._files.put(key, _map_to_bytes(known))
        return BuiltWorld(world, mesh, known)

    def legs(self, built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float) -> list[Leg]:
        """See worlds.shortest.legs_between."""
        if not self._files.on or not ends:
            return legs_between(built, ends, radius)
        told = [(start, goal.name, goal.pose) for start, goal in ends]
        around = built.world.bounds, built.map.shape, built.map.resolution, built.map.origin
        key = key_of("legs", _surface(built.mesh), built.mesh.owners, built.mesh.names, around, told, radius)
        known = _legs_of_bytes(self._files.get(key), len(ends))
        if known is None:
            known = legs_between(built, ends, radius)
            self._files.put(key, to_json(known, inf_nan_mode="strings"))
        return known


def key_of(*parts: object) -> str:
    """The key of what is worked out from these: numbers, texts, arrays, and sequences of them."""
    sha = hashlib.sha256(_circumstances())
    _take(sha, parts)
    return sha.hexdigest()


@cache
def _circumstances() -> bytes:
    """What else decides the last bit."""
    return repr((versions(), code(*_ROOMS), arithmetic())).encode()


def _take(sha: "hashlib._Hash", part: object) -> None:
    if isinstance(part, np.ndarray):
        sha.update(f"{part.dtype.str}{part.shape}".encode())
        sha.update(np.ascontiguousarray(part).data)
    elif isinstance(part, list | tuple):
        sha.update(f"({len(part)}".encode())
        for one in part:
            _take(sha, one)
    else:
        sha.update(f"{part!r}\0".encode())


def _surface(mesh: TriangleMesh) -> tuple[object, object]:
    return mesh.vertices, mesh.faces


def _legs_of_bytes(data: bytes | None, count: int) -> list[Leg] | None:
    try:
        legs = None if data is None else _LEGS.validate_json(data)
    except ValidationError:
        return None
    return legs if legs is not None and len(legs) == count else None


def _map_to_bytes(grid: OccupancyGrid) -> bytes:
    return _MAP.pack(*grid.shape, grid.resolution, *grid.origin) + grid.cells.astype(np.int8).tobytes()


def _map_of_bytes(data: bytes | None) -> OccupancyGrid | None:
    if data is None or len(data) < _MAP.size:
        return None
    rows, columns, resolution, x, y, yaw = _MAP.unpack_from(data)
    if not rows * columns or len(data) != _MAP.size + rows * columns:
        return None
    cells = np.frombuffer(data, np.int8, offset=_MAP.size).reshape(rows, columns).copy()
    return OccupancyGrid(cells, resolution, Pose2(x, y, yaw))
