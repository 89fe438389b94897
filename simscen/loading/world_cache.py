"""Cache of built worlds, and of path searches in them, for the scenarios of one command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from simscen.core.environment.world_model import World
from simscen.core.files import collect_read_files, record_read_file
from simscen.core.geometry.shapes import Solid
from simscen.loading.builders import Bounds, load_world
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.worlds.routes.simple_paths import SimplePaths, simple_paths_between

if TYPE_CHECKING:
    from simscen.worlds.routes.shortest_paths import ShortestPaths

Solids = tuple[Solid, ...]
Paths = TypeVar("Paths")


@dataclass
class WorldCache:
    """Caches built worlds and path searches.

    A path search finds paths of a disc with a `radius` in m between `solids`. Solids block the disc if they reach into
    `z_range` (lowest and highest z in m). The cache compares `solids` by identity.
    """

    max_worlds: int = 100_000
    """Maximum number of worlds in the cache. The oldest worlds are discarded."""
    _worlds: list[tuple[LoadedWorld, World, set[Path]]] = field(default_factory=list)
    """Worlds, and the files from which they were built."""
    _simple_paths: list[tuple[Solids, object, SimplePaths | None]] = field(default_factory=list)
    _shortest_paths: list[tuple[Solids, object, ShortestPaths]] = field(default_factory=list)

    def world(self, loaded: LoadedScenario) -> World:
        """Return the built world of a scenario, and record its files even if it is cached. Raises InvalidInput."""
        known = next((entry for entry in self._worlds if entry[0] == loaded.world), None)
        if known is None:
            with collect_read_files() as read:
                world = load_world(loaded)
            known = loaded.world, world, read
            self._worlds = [*self._worlds, known][-self.max_worlds :]
        for file in sorted(known[2]):
            record_read_file(file)
        return known[1]

    def simple_paths(self, solids: Solids, radius: float, z_range: tuple[float, float]) -> SimplePaths | None:
        """Return a fast path search, which can miss paths; None if a solid is too complex for it."""
        return _cached(
            self._simple_paths, 8, solids, (radius, z_range), lambda: simple_paths_between(solids, radius, z_range)
        )

    def shortest_paths(
        self, solids: Solids, bounds: Bounds, radius: float, z_range: tuple[float, float]
    ) -> ShortestPaths:
        """Return a slower path search within `bounds`, which always finds the shortest path."""

        def search() -> ShortestPaths:
            from simscen.worlds.geometry.triangulation import merge_solids
            from simscen.worlds.routes.shortest_paths import ShortestPaths

            return ShortestPaths(merge_solids(solids), bounds, radius, z_range)

        return _cached(self._shortest_paths, 4, solids, (bounds, radius, z_range), search)


def _cached(
    cache: list[tuple[Solids, object, Paths]], size: int, solids: Solids, key: object, search: Callable[[], Paths]
) -> Paths:
    """Return the path search for `solids` (compared by identity) and `key`, from `cache` or else from `search`.

    `size` is the maximum number of path searches in the cache. The oldest are discarded.
    """
    for known_solids, known_key, paths in cache:
        if known_solids is solids and known_key == key:
            return paths
    cache.append((solids, key, search()))
    del cache[:-size]
    return cache[-1][2]
