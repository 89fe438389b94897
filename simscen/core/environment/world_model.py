"""A world as plain data: solids, bodies, named places, its map, and patches of floor friction."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh

Polygon = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class World:
    """Everything that is there before the robot: `solids` never move, `bodies` may.

    `doors` maps a door's name, which is also its body's, to that body's pose when closed and when open. `friction` is
    that of the floor in some of the `regions`, by name; elsewhere it is 1. `bounds` is (min x, min y, max x, max y) in
    meters. `grid` is set when the world came with an occupancy map of its own (a ROS map). `notes` are warnings of the
    importer, each a sentence that names file and element.
    """

    name: str
    solids: tuple[Solid, ...]
    bodies: tuple[Body, ...] = ()
    places: Mapping[str, Pose2] = field(default_factory=dict)
    regions: Mapping[str, Polygon] = field(default_factory=dict)
    doors: Mapping[str, tuple[Pose2, Pose2]] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)
    bounds: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    grid: OccupancyGrid | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class BuiltWorld:
    """A world made ready once and shared by all its runs; numpy arrays only, so that it survives a fork.

    `mesh` fuses all static solids; `map` is the occupancy grid a robot would have been given.
    """

    world: World
    mesh: TriangleMesh
    map: OccupancyGrid


DISC_CORNERS = 32
"""Corners of the polygon that stands for a round patch."""


@dataclass(frozen=True)
class Patch:
    """A piece of floor: its `outline`, its `friction` against rubber wheels, and the tick at which it is over."""

    outline: Polygon
    friction: float
    until: float = math.inf


def disc_outline(center: tuple[float, float], radius: float) -> Polygon:
    """The outline of a round patch."""
    turns = [2 * math.pi * k / DISC_CORNERS for k in range(DISC_CORNERS)]
    return tuple((center[0] + radius * math.cos(turn), center[1] + radius * math.sin(turn)) for turn in turns)
