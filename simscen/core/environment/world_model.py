"""A world as plain data: solids, bodies, named places, map, floor friction, and pedestrians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh

Polygon = tuple[tuple[float, float], ...]

GRAVITY_M_S2 = 9.81
"""Gravitational acceleration, downwards."""


@dataclass(frozen=True)
class World:
    """Everything in the world except the robots: `solids` are fixed, `bodies` can move.

    `doors` maps the name of a door, which is also the name of its body, to the poses of the body when closed and open.
    `friction` maps names of `regions` to the friction of their floor; it is 1 elsewhere. `bounds` is (min x, min y, max
    x, max y) in m. With `has_open_ground`, the level ground reaches beyond `bounds`. `grid` is set if the world has its
    own occupancy map (a ROS map). `notes` are warnings of the importer, each with file and element.
    """

    name: str
    solids: tuple[Solid, ...]
    bodies: tuple[Body, ...] = ()
    places: Mapping[str, Pose2] = field(default_factory=dict)
    regions: Mapping[str, Polygon] = field(default_factory=dict)
    doors: Mapping[str, tuple[Pose2, Pose2]] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)
    bounds: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    has_open_ground: bool = False
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
