"""Cache prepared scenarios in memory, and maps and shortest paths of worlds on disk."""

import contextlib
import hashlib
import os
import pickle
import stat
import struct
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.goals import Goal
from simscen.loading.builders import load_world
from simscen.loading.loaded import LoadedScenario
from simscen.loading.open_ground import with_stops_in_bounds
from simscen.run.preparation import PreparedScenario, map_resolution, prepare
from simscen.run.reproducibility import arithmetic_fingerprints, software_versions, source_digest
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_size import MAP_RESOLUTION_M
from simscen.worlds.maps.occupancy_map import draw_map
from simscen.worlds.routes.shortest_paths import Leg, legs_between

CACHE_DIR_VARIABLE, CACHE_OFF = "SIMSCEN_CACHE_DIR", "off"
"""Environment variable with the absolute path of the cache folder, and its value that disables the disk cache."""
CACHE_FORMAT = "worlds-1"
"""Name of the subfolder for entries. Change it when the format of entries changes."""
MAX_CACHE_BYTES = 256_000_000
"""Size limit of the disk cache. Above it, the least recently used entries are deleted."""
MAX_ENTRY_BYTES = 32_000_000
"""Size limit of one entry; a larger entry is not stored."""
_DIGEST_BYTES = hashlib.sha256().digest_size


def cache_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder for entries: in $SIMSCEN_CACHE_DIR, $XDG_CACHE_HOME/simscen, or ~/.cache/simscen.

    Returns None if $SIMSCEN_CACHE_DIR is `off` or not absolute, or if there is no home folder.
    """
    if (configured := environment.get(CACHE_DIR_VARIABLE)) is not None:
        return Path(configured) / CACHE_FORMAT if configured != CACHE_OFF and Path(configured).is_absolute() else None
    for base, subfolder in ((environment.get("XDG_CACHE_HOME", ""), ""), (environment.get("HOME", ""), ".cache")):
        if Path(base).is_absolute():
            return Path(base, subfolder, "simscen", CACHE_FORMAT)
    return None


class DiskCache:
    """Cache with one file for each entry, named after its key. Concurrent sessions can share the folder.

    Without a `folder`, the cache is disabled. `max_bytes` limits the total size of all entries.
    """

    def __init__(self, folder: Path | None, max_bytes: int = MAX_CACHE_BYTES) -> None:
        self._folder, self._max_bytes = folder, max_bytes
        self._remaining_bytes: int | None = None

    @property
    def is_enabled(self) -> bool:
        """Whether the cache is enabled."""
        return self._folder is not None

    def get(self, key: str) -> bytes | None:
        """Return the entry of a key, or None if the entry is missing or damaged."""
        if self._folder is None or not is_private_folder(self._folder):
            return None
        try:
            descriptor = os.open(self._folder / key, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            with os.fdopen(descriptor, "rb") as file:
                status = os.fstat(descriptor)
                if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_ENTRY_BYTES:
                    return None
                data = file.read(MAX_ENTRY_BYTES)
                os.utime(descriptor)
        except OSError:  # missing or unreadable: the caller computes it again
            return None
        content = data[_DIGEST_BYTES:]
        return content if hashlib.sha256(key.encode() + content).digest() == data[:_DIGEST_BYTES] else None

    def put(self, key: str, content: bytes) -> None:
        """Store an entry. Does nothing if the entry is too large or the folder cannot be used."""
        data = hashlib.sha256(key.encode() + content).digest() + content
        if self._folder is None or len(data) > min(MAX_ENTRY_BYTES, self._max_bytes):
            return
        # A full disk or a read-only home must not fail the session.
        with contextlib.suppress(OSError):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if is_private_folder(self._folder):
                self._write(self._folder, key, data)

    def _write(self, folder: Path, key: str, data: bytes) -> None:
        if self._remaining_bytes is None or self._remaining_bytes < len(data):
            self._remaining_bytes = self._max_bytes - _prune(folder, self._max_bytes - len(data))
        self._remaining_bytes -= len(data)
        descriptor, part = tempfile.mkstemp(prefix=".", suffix=".part", dir=folder)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            Path(part).replace(folder / key)
        except OSError:
            Path(part).unlink(missing_ok=True)
            raise


def is_private_folder(folder: Path) -> bool:
    """Return whether a folder exists, belongs to this user, and no other user can write to it."""
    try:
        status = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022


def disk_usage(folder: Path) -> tuple[int, int]:
    """Return the number of files in a folder and their total size in bytes."""
    sizes = [size for _, size, _ in _files(folder)]
    return len(sizes), sum(sizes)


def _prune(folder: Path, max_bytes: int) -> int:
    """Delete the least recently used files until at most `max_bytes` bytes remain; return the remaining size."""
    files = sorted(_files(folder))
    total = sum(size for _, size, _ in files)
    for _, size, name in files:
        if total <= max_bytes:
            break
        (folder / name).unlink(missing_ok=True)
        total -= size
    return total


def _files(folder: Path) -> list[tuple[int, int, str]]:
    """Return the time of last use (ns), size (bytes), and name of each file."""
    files = []
    with os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # deleted by another session
                status = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(status.st_mode):
                    files.append((status.st_mtime_ns, status.st_size, entry.name))
    return files


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
        key = cache_key("map", _vertices_and_faces(mesh), world.bounds, places, grid, lidar_height, resolution)
        cached = _map_from_bytes(self._cache.get(key))
        if cached is None:
            cached = draw_map(world, mesh, lidar_height, resolution)
            self._cache.put(key, _map_to_bytes(cached))
        return BuiltWorld(world, mesh, cached)

    def legs(self, built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float) -> list[Leg]:
        """Return the shortest path of a disc of `radius` m from each pose to its goal."""
        if not self._cache.is_enabled or not ends:
            return legs_between(built, ends, radius)
        goals = [(start, goal.name, goal.pose) for start, goal in ends]
        map_frame = built.world.bounds, built.map.shape, built.map.resolution, built.map.origin
        key = cache_key(
            "legs", _vertices_and_faces(built.mesh), built.mesh.owners, built.mesh.names, map_frame, goals, radius
        )
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


def _vertices_and_faces(mesh: TriangleMesh) -> tuple[object, object]:
    return mesh.vertices, mesh.faces


def _legs_from_bytes(data: bytes | None, count: int) -> list[Leg] | None:
    try:
        legs = None if data is None else _LEGS.validate_json(data)
    except ValidationError:
        return None
    return legs if legs is not None and len(legs) == count else None


def _map_to_bytes(grid: OccupancyGrid) -> bytes:
    return _MAP_HEADER.pack(*grid.shape, grid.resolution, *grid.origin) + grid.cells.astype(np.int8).tobytes()


def _map_from_bytes(data: bytes | None) -> OccupancyGrid | None:
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
        if world is not self._worlds[digest]:  # the map belongs to the stops of this scenario
            return self._builder.build(world, *key[1:])
        if key not in self._built:
            self._built[key] = self._builder.build(world, *key[1:])
        return self._built[key]
