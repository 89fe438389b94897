"""Build the triangle mesh and the occupancy map of a world, and summarize a built world for `simscen world inspect`."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry.shapes import Solid
from simscen.worlds.extent import placed_solids
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_size import MAP_RESOLUTION_M
from simscen.worlds.maps.occupancy_map import draw_map


def build_world_and_map(world: World, lidar_height: float, resolution: float = MAP_RESOLUTION_M) -> BuiltWorld:
    """Merge the static solids to one mesh, and draw the map that SLAM with a lidar at `lidar_height` m would build.

    `resolution` is the edge length of a map cell in m. Raises InvalidInput for a map of more than MAX_MAP_CELLS cells.
    """
    mesh = merge_solids(world.solids)
    return BuiltWorld(world, mesh, draw_map(world, mesh, lidar_height, resolution))


Extent = tuple[float, float, float, float, float, float]
"""(min x, min y, min z, max x, max y, max z) in m."""


@dataclass(frozen=True)
class WorldItem:
    """A static solid or a body in a summary."""

    name: str
    shape: str
    """Kind of shape, for example "box"; "box+cylinder" for a body with both."""
    triangles: int
    extent: Extent
    """Bounding box in the world frame; zeros without triangles."""
    mass: float | None = None
    """In kg; 0 for a body that cannot be pushed, None for a static solid."""


@dataclass(frozen=True)
class WorldSummary:
    """Summary of a world. The names of the fields are keys of the JSON output."""

    name: str
    bounds: tuple[float, float, float, float]
    """(min x, min y, max x, max y) in m."""
    solids: tuple[WorldItem, ...]
    bodies: tuple[WorldItem, ...]
    map_size: tuple[int, int]
    """Rows and columns."""
    map_resolution: float
    """Edge length of a cell in m."""
    map_shares: tuple[float, float, float]
    """Fractions of occupied, free and unknown cells."""
    places: tuple[str, ...]
    """Names of all places, sorted."""
    regions: tuple[str, ...]
    """Names of all regions, sorted."""
    notes: tuple[str, ...]
    """Notes of the importer, for example about ignored elements."""

    @property
    def triangles(self) -> int:
        """Number of triangles of all solids and bodies."""
        return sum(item.triangles for item in (*self.solids, *self.bodies))

    @property
    def shapes(self) -> tuple[tuple[str, int], ...]:
        """Pairs (kind of shape, number of solids), the most frequent kind first."""
        counts = Counter(item.shape for item in self.solids)
        return tuple(sorted(counts.items(), key=lambda entry: (-entry[1], entry[0])))


def inspect_world(built: BuiltWorld) -> WorldSummary:
    """Return the summary of a world."""
    world, cells = built.world, built.map.cells
    occupied = float(np.mean(cells == OCCUPIED)) if cells.size else 0.0
    unknown = float(np.mean(cells == UNKNOWN)) if cells.size else 0.0
    return WorldSummary(
        name=world.name,
        bounds=world.bounds,
        solids=tuple(_summarize_item(solid.name, [solid]) for solid in world.solids),
        bodies=tuple(_summarize_item(body.name, placed_solids([], [body]), body.mass) for body in world.bodies),
        map_size=built.map.shape,
        map_resolution=built.map.resolution,
        map_shares=(occupied, 1.0 - occupied - unknown, unknown),
        places=tuple(sorted(world.places)),
        regions=tuple(sorted(world.regions)),
        notes=world.notes,
    )


def _summarize_item(name: str, solids: list[Solid], mass: float | None = None) -> WorldItem:
    """Return the summary of a static solid, or of the solids of a body in the world frame."""
    kinds = "+".join(dict.fromkeys(type(solid.shape).__name__.lower() for solid in solids))
    mesh = merge_solids(solids)
    extent: Extent = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if len(mesh.vertices):
        x0, y0, z0 = mesh.vertices.min(axis=0).tolist()
        x1, y1, z1 = mesh.vertices.max(axis=0).tolist()
        extent = x0, y0, z0, x1, y1, z1
    return WorldItem(name, kinds, len(mesh.faces), extent, mass)
