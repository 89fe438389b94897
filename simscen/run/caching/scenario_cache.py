"""Shortest ways and maps of worlds, kept between sessions: they are what takes longest to prepare.

For a house, the ways to the goals take 50 to 250 ms and the map 4, to read both takes 1; of a map of 100 x 100 m or a
warehouse of 5000 objects, 0.5 to 0.7 s and 0.4 s against 30 ms, most of which goes into the key. Solids are fused in
1 to 2 ms (150 ms in the large ones), which is less than to look whether that is known; meshes are read anew.
"""

import hashlib
import pickle
import struct
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.navigation import Goal
from simscen.loading.loaded import LoadedScenario
from simscen.run.caching.disk_cache import DiskCache
from simscen.run.preparation.loaders import load_world
from simscen.run.preparation.scenario import PreparedScenario, prepare
from simscen.run.reproducibility.environment import arithmetic_fingerprints, software_versions, source_digest
from simscen.worlds.build import build
from simscen.worlds.mapsize import RESOLUTION
from simscen.worlds.meshing import fuse
from simscen.worlds.shortest import Leg, legs_between
from simscen.worlds.slicing import map_of

_LEGS = TypeAdapter(list[Leg])
_MAP = struct.Struct("<II4d")
_ROOMS = ("core", "worlds", "ways")
"""Where the code is that the results depend on."""


class CachedWorldBuilder:
    """Works out what `build` and `legs_between` do, or knows it. Equal worlds give equal results, to the last bit."""

    def __init__(self, files: DiskCache) -> None:
        self._files = files

    def build(self, world: World, lidar_height: float) -> BuiltWorld:
        """See worlds.build."""
        if not self._files.on:
            return build(world, lidar_height)
        mesh = fuse(world.solids)
        places = [tuple(pose) for pose in world.places.values()]
        grid = world.grid and (world.grid.cells, world.grid.resolution, world.grid.origin)
        key = cache_key("map", _surface(mesh), world.bounds, places, grid, lidar_height, RESOLUTION)
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
        key = cache_key("legs", _surface(built.mesh), built.mesh.owners, built.mesh.names, around, told, radius)
        known = _legs_of_bytes(self._files.get(key), len(ends))
        if known is None:
            known = legs_between(built, ends, radius)
            self._files.put(key, to_json(known, inf_nan_mode="strings"))
        return known


def cache_key(*parts: object) -> str:
    """The key of what is worked out from these: numbers, texts, arrays, and sequences of them."""
    sha = hashlib.sha256(_circumstances())
    _take(sha, parts)
    return sha.hexdigest()


@cache
def _circumstances() -> bytes:
    """What else decides the last bit."""
    return repr((software_versions(), source_digest(*_ROOMS), arithmetic_fingerprints())).encode()


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


# MERGED: Keeps what has been prepared, so that a world is built once for all the runs in it.
MAX_SCENARIOS = 100
"""Scenarios that are kept; their runs follow each other, and a file may have a thousand variations."""


class ScenarioCache:
    """Prepares scenarios; lives in the warm process, whose forks inherit what is here."""

    def __init__(self, kept: CachedWorldBuilder) -> None:
        """`kept` is what earlier sessions left."""
        self._kept = kept
        self._worlds: dict[str, BuiltWorld] = {}
        self._scenarios: dict[tuple[str, str, str], PreparedScenario] = {}

    def prepared(self, loaded: LoadedScenario) -> PreparedScenario:
        """The prepared scenario; the first one in a world builds it. Raises InvalidInput."""
        name = loaded.id, loaded.variation, loaded.stack_name
        if name not in self._scenarios:
            if len(self._scenarios) == MAX_SCENARIOS:
                del self._scenarios[next(iter(self._scenarios))]
            self._scenarios[name] = prepare(loaded, self._world, self._kept.legs)
        return self._scenarios[name]

    def clear(self) -> None:
        """Forget everything."""
        self._worlds.clear()
        self._scenarios.clear()

    def _world(self, loaded: LoadedScenario, height: float) -> BuiltWorld:
        key = hashlib.sha256(pickle.dumps((replace(loaded.world, tree=None), height))).hexdigest()
        if key not in self._worlds:
            self._worlds[key] = self._kept.build(load_world(loaded), height)
        return self._worlds[key]
