"""Cache of built worlds, and of path searches in them, for the scenarios of one command."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.core.environment.world_model import World
from simscen.core.files import collect_read_files, record_read_file
from simscen.core.geometry.shapes import Solid
from simscen.loading.builders import load_world
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.worlds.routes.simple_paths import SimplePaths, simple_paths_between

if TYPE_CHECKING:
    from simscen.worlds.routes.shortest_paths import ShortestPaths

Bounds = tuple[float, float, float, float]
"""(min x, min y, max x, max y) in m."""


@dataclass
class WorldCache:
    """Caches built worlds and path searches.

    A path search finds paths of a disc with a `radius` in m between `solids`. Solids block the disc if they reach into
    `z_range` (lowest and highest z in m). The cache compares `solids` by identity.
    """

    max_worlds: int = 100_000
    """Largest number of worlds in the cache. The oldest worlds are discarded."""
    _worlds: list[tuple[LoadedWorld, World, set[Path]]] = field(default_factory=list)
    """Worlds, and the files from which they were built."""
    _simple_paths: list[tuple[tuple[Solid, ...], float, tuple[float, float], SimplePaths | None]] = field(
        default_factory=list
    )
    _shortest_paths: list[tuple[tuple[Solid, ...], Bounds, float, tuple[float, float], ShortestPaths]] = field(
        default_factory=list
    )

    def world(self, loaded: LoadedScenario) -> World:
        """Return the built world of a scenario. Raises InvalidInput.

        Calls `record_read_file` for each file from which the world was built, also if it was built by an earlier call.
        """
        known = next((entry for entry in self._worlds if entry[0] == loaded.world), None)
        if known is None:
            with collect_read_files() as read:
                world = load_world(loaded)
            known = loaded.world, world, read
            self._worlds = [*self._worlds, known][-self.max_worlds :]
        for file in sorted(known[2]):
            record_read_file(file)
        return known[1]

    def simple_paths(
        self, solids: tuple[Solid, ...], radius: float, z_range: tuple[float, float]
    ) -> SimplePaths | None:
        """Return a fast path search, which can miss paths; None if a solid is too complex for it."""
        for known in self._simple_paths:
            if known[0] is solids and known[1:3] == (radius, z_range):
                return known[3]
        paths = simple_paths_between(solids, radius, z_range)
        self._simple_paths = [*self._simple_paths[-7:], (solids, radius, z_range, paths)]
        return paths

    def shortest_paths(
        self, solids: tuple[Solid, ...], bounds: Bounds, radius: float, z_range: tuple[float, float]
    ) -> ShortestPaths:
        """Return a slower path search within `bounds`, which always finds the shortest path."""
        for known in self._shortest_paths:
            if known[0] is solids and known[1:4] == (bounds, radius, z_range):
                return known[4]
        from simscen.worlds.geometry.triangulation import merge_solids
        from simscen.worlds.routes.shortest_paths import ShortestPaths

        paths = ShortestPaths(merge_solids(solids), bounds, radius, z_range)
        self._shortest_paths = [
            *self._shortest_paths[-3:],
            (solids, bounds, radius, z_range, paths),
        ]  # large objects: keep only the last four
        return paths
