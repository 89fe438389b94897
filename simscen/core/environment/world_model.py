"""A world as plain data: solids, bodies, named places, map, floor friction; and what a log stores for pictures."""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from simscen.core.environment.costmap_filters import Filter, MaskBlocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh

Polygon = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class World:
    """Everything in the world except the robots: `solids` are fixed, `bodies` can move.

    `doors` maps the name of a door, which is also the name of its body, to the poses of the body when closed and open.
    `friction` maps names of `regions` to the friction of their floor; it is 1 elsewhere. `bounds` is (min x, min y, max
    x, max y) in m. `grid` is set if the world has its own occupancy map (a ROS map). `notes` are warnings of the
    importer, each with file and element.
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
    """World that is prepared once and shared by all its runs.

    It contains only numpy arrays, so that it survives a fork. `mesh` fuses all fixed solids. `map` is the occupancy
    grid that robots get.
    """

    world: World
    mesh: TriangleMesh
    map: OccupancyGrid


DISC_CORNERS = 32
"""Number of corners of the polygon that approximates a disc."""


@dataclass(frozen=True)
class Patch:
    """Patch of floor: its `outline`, its `friction` for rubber wheels, and the last tick at which it exists."""

    outline: Polygon
    friction: float
    until: float = math.inf


def disc_outline(center: tuple[float, float], radius: float) -> Polygon:
    """Return the outline of a disc as a polygon."""
    turns = [2 * math.pi * k / DISC_CORNERS for k in range(DISC_CORNERS)]
    return tuple((center[0] + radius * math.cos(turn), center[1] + radius * math.sin(turn)) for turn in turns)


Behavior = Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"]
"""Reaction of a pedestrian to the robot, with the names of HuNavSim."""
Unseen = Literal["robots", "people", "objects"]
"""What a pedestrian can ignore; "people" are other pedestrians."""
Repeat = Literal["once", "loop", "back_and_forth"]

BODY_HEIGHT_M = 1.7
"""Height of the upright cylinder that represents a pedestrian."""


@dataclass(frozen=True)
class WalkingPedestrian:
    """Pedestrian that starts at rest at `pose` and walks to `goals` (x, y in m) in turn.

    `speed` is the preferred speed in m/s; `radius` and `height` of the body are in m. Pedestrians of the same `group`
    stay together. `blind_to` lists what the pedestrian ignores. Reactions other than regular and impassive begin within
    `reacts_within` m of a robot and last `reacts_for` s.
    """

    name: str
    pose: Pose2
    goals: tuple[tuple[float, float], ...] = ()
    repeat: Repeat = "once"
    speed: float = 1.3
    radius: float = 0.25
    height: float = BODY_HEIGHT_M
    behavior: Behavior = "regular"
    group: str | None = None
    blind_to: frozenset[Unseen] = frozenset()
    reacts_within: float = 0.0
    reacts_for: float = 0.0


@dataclass(frozen=True)
class PedestrianAction:
    """Action of a pedestrian: it reached a goal, began a reaction, or ended one.

    `about` is the number of the goal (from 1) or the name of the robot.
    """

    name: str
    what: Literal["reached", "reacted", "calmed"]
    about: str


@dataclass(frozen=True)
class MovableObject:
    """Movable object with its start pose and its outlines from above.

    `outlines` are in the frame of the object. `closed` and `opened` are the poses of a door panel, whose frame is at
    the hinge. `mass` is in kg; 0 for an object that cannot be pushed.
    """

    name: str
    pose: Pose2
    outlines: tuple[Polygon, ...]
    closed: Pose2 | None = None
    opened: Pose2 | None = None
    mass: float = 0.0


@dataclass(frozen=True)
class DrivableSurface:
    """Surface on which wheels can roll: a ramp, a sill, or a platform.

    `height` of the highest point is in m. `uphill` is the rise per meter along x and y; zeros for a level surface.
    """

    name: str
    outline: Polygon
    height: float
    uphill: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class FrictionRegion:
    """Region whose floor friction differs from 1, the value of dry concrete, from the start."""

    region: str
    outline: Polygon
    friction: float


@dataclass(frozen=True)
class FilterZone:
    """Zone of a costmap filter of `robot` at the start of the run. `speed_limit` is in m/s; 0 for none.

    The zone of a filter mask has `cells` instead of a region and an outline.
    """

    filter: Filter
    region: str = ""
    outline: Polygon = ()
    speed_limit: float = 0.0
    cells: MaskBlocks | None = None
    robot: str = ""


@dataclass(frozen=True)
class CompressedGrid:
    """Occupancy grid as plain data; `data` is its int8 cells in row order, compressed by zlib, in base64."""

    width: int
    height: int
    resolution: float
    origin: Pose2
    data: str

    @classmethod
    def of(cls, grid: OccupancyGrid) -> CompressedGrid:
        """Return the compressed grid."""
        packed = zlib.compress(np.ascontiguousarray(grid.cells).tobytes(), 9)
        height, width = grid.shape
        return cls(width, height, grid.resolution, grid.origin, base64.b64encode(packed).decode("ascii"))

    @property
    def grid(self) -> OccupancyGrid:
        """The uncompressed grid. Raises ValueError if it is damaged."""
        try:
            cells = np.frombuffer(zlib.decompress(base64.b64decode(self.data)), dtype=np.int8)
        except zlib.error as error:
            raise ValueError(f"the cells of the map are damaged: {error}") from None
        return OccupancyGrid(cells.reshape(self.height, self.width), self.resolution, self.origin)


@dataclass(frozen=True)
class Scenery:
    """Visible parts of the world at the start of a run. `map` is set if it differs from the map of the robot."""

    places: Mapping[str, Pose2] = field(default_factory=dict)
    things: tuple[MovableObject, ...] = ()
    ground: tuple[DrivableSurface, ...] = ()
    floors: tuple[FrictionRegion, ...] = ()
    zones: tuple[FilterZone, ...] = ()
    map: CompressedGrid | None = None
