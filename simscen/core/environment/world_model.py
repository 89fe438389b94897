"""Plain data of a world: solids, bodies, named places, map, floor friction, and pedestrians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh

Polygon = tuple[tuple[float, float], ...]
"""Corners (x, y) in m, in order; the last one is connected to the first one."""

GRAVITY_M_S2 = 9.81
"""Gravitational acceleration, positive downwards."""


@dataclass(frozen=True)
class World:
    """Everything in the world except the robots.

    Attributes:
        solids: Parts that never move.
        bodies: Objects that can move.
        doors: Poses of each door panel when closed and when open, by the name of its body.
        friction: Friction of the floor by name of region; 1 elsewhere.
        bounds: (min x, min y, max x, max y) in m.
        has_open_ground: Whether the level ground reaches beyond `bounds`.
        grid: Occupancy map that the world was loaded from (a ROS map); None for other worlds.
        notes: Warnings of the importer, each with file and element.
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
    """World that is prepared once for all its runs.

    `mesh` contains all fixed solids, and `map` is the occupancy grid that robots get. Both consist of numpy arrays,
    which remain valid in worker processes that are forked.
    """

    world: World
    mesh: TriangleMesh
    map: OccupancyGrid


DISC_CORNERS = 32
"""Number of corners of the polygon that approximates a disc."""


@dataclass(frozen=True)
class Patch:
    """Part of the floor with another friction.

    `friction` is that of rubber wheels. `until` is the last tick at which the patch exists; inf for the whole run.
    """

    outline: Polygon
    friction: float
    until: float = math.inf


def disc_outline(center: tuple[float, float], radius: float) -> Polygon:
    """Return a polygon with DISC_CORNERS corners on the circle around `center` with `radius` in m."""
    turns = [2 * math.pi * k / DISC_CORNERS for k in range(DISC_CORNERS)]
    return tuple((center[0] + radius * math.cos(turn), center[1] + radius * math.sin(turn)) for turn in turns)


Behavior = Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"]
"""Reaction of a pedestrian to the robot, with the names of HuNavSim."""
Unseen = Literal["robots", "people", "objects"]
"""What a pedestrian can ignore; "people" are other pedestrians."""
Repeat = Literal["once", "loop", "back_and_forth"]
"""Order in which a pedestrian walks to its goals."""

BODY_HEIGHT_M = 1.7
"""Height of the upright cylinder that represents a pedestrian."""


@dataclass(frozen=True)
class WalkingPedestrian:
    """Pedestrian that starts at rest at `pose` and walks to `goals` (x, y in m) one after the other.

    `speed` is the preferred speed in m/s; `radius` and `height` of the body are in m. Pedestrians of the same `group`
    stay together. `blind_to` lists what the pedestrian ignores. Behaviors other than regular and impassive are
    reactions: they begin within `reacts_within` m of a robot and last for `reacts_for` s.
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
    """Something that a pedestrian did: it reached a goal, began a reaction to a robot, or ended it (calmed).

    `name` is that of the pedestrian. `about` is the number of the goal (from 1) or the name of the robot.
    """

    name: str
    what: Literal["reached", "reacted", "calmed"]
    about: str
