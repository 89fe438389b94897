"""Cache prepared scenarios in memory, and maps and shortest paths of worlds on disk."""

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
from simscen.core.messages.goals import Goal
from simscen.loading.builders import load_world, with_stops_in_bounds
from simscen.loading.loaded import LoadedScenario
from simscen.run.disk_cache import DiskCache
from simscen.run.platform_fingerprint import arithmetic_fingerprints, software_versions, source_digest
from simscen.run.preparation import PreparedScenario, map_resolution, prepare
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_size import MAP_RESOLUTION_M
from simscen.worlds.maps.occupancy_map import draw_map
from simscen.worlds.routes.shortest_paths import Leg, legs_between

_LEGS = TypeAdapter(list[Leg])
_MAP_HEADER = struct.Struct("<II4d")
"""Rows, columns, resolution (m), and origin (x, y, yaw) of a map. The cells follow."""
_CODE_PARTS = ("core", "grid_graph.py", "worlds")
"""Subpackages and modules of simscen whose code affects the cached results."""


class CachedWorldBuilder:
    """Reads maps and shortest paths from the disk cache, or computes them."""

    def __init__(self, cache: DiskCache) -> None:
        self._cache = cache

    def build(self, world: World, lidar_height: float, resolution: float = MAP_RESOLUTION_M) -> BuiltWorld:
        """Return the world with its mesh, and its map as seen by a lidar at `lidar_height` m. `resolution` is in m."""
        if not self._cache.is_enabled:
            return build_world_and_map(world, lidar_height, resolution)
        mesh = merge_solids(world.solids)
        places = [tuple(pose) for pose in world.places.values()]
        grid = world.grid and (world.grid.cells, world.grid.resolution, world.grid.origin)
        key = cache_key("map", (mesh.vertices, mesh.faces), world.bounds, places, grid, lidar_height, resolution)
        cached = _map_from_bytes(self._cache.get(key))
        if cached is None:
            cached = draw_map(world, mesh, lidar_height, resolution)
            header = _MAP_HEADER.pack(*cached.shape, cached.resolution, *cached.origin)
            self._cache.put(key, header + cached.cells.astype(np.int8).tobytes())
        return BuiltWorld(world, mesh, cached)

    def legs(self, built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float) -> list[Leg]:
        """Return the shortest path of a disc of `radius` m from each pose to its goal."""
        if not self._cache.is_enabled or not ends:
            return legs_between(built, ends, radius)
        mesh, goals = built.mesh, [(start, goal.name, goal.pose) for start, goal in ends]
        map_frame = built.world.bounds, built.map.shape, built.map.resolution, built.map.origin
        key = cache_key("legs", (mesh.vertices, mesh.faces), mesh.owners, mesh.names, map_frame, goals, radius)
        cached = _legs_from_bytes(self._cache.get(key), len(ends))
        if cached is None:
            cached = legs_between(built, ends, radius)
            self._cache.put(key, to_json(cached, inf_nan_mode="strings"))
        return cached


def cache_key(*parts: object) -> str:
    """Return the cache key (a SHA-256) of a result that depends on `parts`: numbers, strings, arrays, and sequences.

    The key also depends on the versions of simscen and other software, and on the processor.
    """
    sha = hashlib.sha256(_environment_key())
    _update_hash(sha, parts)
    return sha.hexdigest()


@cache
def _environment_key() -> bytes:
    """Return the versions, source code digest, and arithmetic fingerprints on which all keys depend."""
    return repr((software_versions(), source_digest(*_CODE_PARTS), arithmetic_fingerprints())).encode()


def _update_hash(sha: "hashlib._Hash", part: object) -> None:
    if isinstance(part, np.ndarray):
        sha.update(f"{part.dtype.str}{part.shape}".encode())
        sha.update(np.ascontiguousarray(part).data)
    elif isinstance(part, list | tuple):
        sha.update(f"({len(part)}".encode())
        for item in part:
            _update_hash(sha, item)
    else:
        sha.update(f"{part!r}\0".encode())


def _legs_from_bytes(data: bytes | None, count: int) -> list[Leg] | None:
    """Decode an entry of the cache with `count` paths; return None if the entry is missing or invalid."""
    try:
        legs = None if data is None else _LEGS.validate_json(data)
    except ValidationError:
        return None
    return legs if legs is not None and len(legs) == count else None


def _map_from_bytes(data: bytes | None) -> OccupancyGrid | None:
    """Decode an entry of the cache with a map; return None if the entry is missing or invalid."""
    if data is None or len(data) < _MAP_HEADER.size:
        return None
    rows, columns, resolution, x, y, yaw = _MAP_HEADER.unpack_from(data)
    if not rows * columns or len(data) != _MAP_HEADER.size + rows * columns:
        return None
    cells = np.frombuffer(data, np.int8, offset=_MAP_HEADER.size).reshape(rows, columns).copy()
    return OccupancyGrid(cells, resolution, Pose2(x, y, yaw))


MAX_SCENARIOS = 100
"""Largest number of prepared scenarios in memory."""


class ScenarioCache:
    """Cache of prepared scenarios and built worlds in memory, which forked worker processes inherit."""

    def __init__(self, builder: CachedWorldBuilder) -> None:
        self._builder = builder
        self._worlds: dict[str, World] = {}
        self._built: dict[tuple[str, float, float], BuiltWorld] = {}
        self._scenarios: dict[tuple[str, str, str], PreparedScenario] = {}

    def get_or_prepare(self, loaded: LoadedScenario) -> PreparedScenario:
        """Return the prepared scenario, from memory if possible. Raises InvalidInput for unusable files."""
        name = loaded.id, loaded.variation, loaded.stack_name
        cached = self._scenarios.get(name)
        if cached is None or cached.loaded != loaded:
            if cached is None and len(self._scenarios) == MAX_SCENARIOS:
                del self._scenarios[next(iter(self._scenarios))]
            cached = self._scenarios[name] = prepare(loaded, self._build_world, self._builder.legs)
        return cached

    def clear(self) -> None:
        """Remove all entries."""
        self._worlds.clear()
        self._built.clear()
        self._scenarios.clear()

    def _build_world(self, loaded: LoadedScenario, height: float) -> BuiltWorld:
        """Return the world of a scenario with the map at `height` m, from memory if possible."""
        digest = hashlib.sha256(pickle.dumps(replace(loaded.world, tree=None))).hexdigest()
        if digest not in self._worlds:
            self._worlds[digest] = load_world(loaded)
        world = with_stops_in_bounds(self._worlds[digest], loaded)
        key = digest, height, map_resolution(loaded, world)
        if world is not self._worlds[digest]:  # enlarged for the stops of this scenario
            return self._builder.build(world, *key[1:])
        if key not in self._built:
            self._built[key] = self._builder.build(world, *key[1:])
        return self._built[key]
