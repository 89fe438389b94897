"""What a world holds, as `simscen world inspect` tells it."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.worlds.geometry.triangulation import fuse

Extent = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Item:
    """One solid or body: `extent` is (min x, y, z, max x, y, z) in meters in the world's frame."""

    name: str
    shape: str
    triangles: int
    extent: Extent
    mass: float | None = None
    """In kg; None for what never moves."""


@dataclass(frozen=True)
class Inspection:
    """A world in numbers: what never moves, what may, its map, and what its importer had to say."""

    name: str
    bounds: tuple[float, float, float, float]
    solids: tuple[Item, ...]
    bodies: tuple[Item, ...]
    map_size: tuple[int, int]
    """Rows and columns."""
    map_resolution: float
    map_shares: tuple[float, float, float]
    """Of occupied, free and unknown cells; they add up to 1."""
    places: tuple[str, ...]
    regions: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def triangles(self) -> int:
        """Of all solids and bodies."""
        return sum(item.triangles for item in (*self.solids, *self.bodies))

    @property
    def shapes(self) -> tuple[tuple[str, int], ...]:
        """How often each kind of shape stands among the solids, the most frequent first."""
        counts = Counter(item.shape for item in self.solids)
        return tuple(sorted(counts.items(), key=lambda entry: (-entry[1], entry[0])))


def inspect(built: BuiltWorld) -> Inspection:
    """Everything there is to tell about a world."""
    world, cells = built.world, built.map.cells
    occupied = float(np.mean(cells == OCCUPIED)) if cells.size else 0.0
    unknown = float(np.mean(cells == UNKNOWN)) if cells.size else 0.0
    bodies = []
    for body in world.bodies:
        placed = tuple(Solid(s.shape, body.pose.compose(s.pose), s.name) for s in body.solids)
        kinds = "+".join(dict.fromkeys(_kind(solid) for solid in placed))
        bodies.append(_item(body.name, kinds, placed, body.mass))
    return Inspection(
        name=world.name,
        bounds=world.bounds,
        solids=tuple(_item(solid.name, _kind(solid), (solid,)) for solid in world.solids),
        bodies=tuple(bodies),
        map_size=built.map.shape,
        map_resolution=built.map.resolution,
        map_shares=(occupied, 1.0 - occupied - unknown, unknown),
        places=tuple(sorted(world.places)),
        regions=tuple(sorted(world.regions)),
        notes=world.notes,
    )


def _kind(solid: Solid) -> str:
    return type(solid.shape).__name__.lower()


def _item(name: str, kind: str, solids: tuple[Solid, ...], mass: float | None = None) -> Item:
    mesh = fuse(solids)
    return Item(name, kind, len(mesh.faces), _extent(mesh), mass)


def _extent(mesh: TriangleMesh) -> Extent:
    if not len(mesh.vertices):
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    x0, y0, z0 = mesh.vertices.min(axis=0).tolist()
    x1, y1, z1 = mesh.vertices.max(axis=0).tolist()
    return x0, y0, z0, x1, y1, z1
