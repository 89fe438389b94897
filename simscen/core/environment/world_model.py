"""Data of a world: fixed solids, movable bodies, places, regions, doors, floor friction, map, and pedestrians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh

GRAVITY_M_S2 = 9.81
"""Gravitational acceleration, positive downwards."""


@dataclass(frozen=True)
class World:
    """Contents of a world, without the robots, and without the pedestrians and objects that events add.

    Attributes:
        solids: Parts that never move.
        bodies: Objects that can move.
        places: Named poses.
        regions: Named polygons.
        doors: Closed pose and open pose of each door panel, by the name of its body.
        friction: Friction coefficient of the floor by name of region; 1 elsewhere.
        bounds: (min x, min y, max x, max y) in m.
        has_open_ground: Whether the level ground continues beyond `bounds`.
        grid: ROS map that the world was loaded from; None for other worlds.
        notes: Warnings of the importer, with file and element.
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
    """World with its `mesh` of all fixed solids, and its `map`: the occupancy grid for robots without their own map.

    All runs in a world share these data.
    """

    world: World
    mesh: TriangleMesh
    map: OccupancyGrid


DISC_CORNERS = 32
"""Number of corners of a polygon that approximates a disc."""


@dataclass(frozen=True)
class FloorPatch:
    """Part of the floor with changed friction.

    `friction` is the coefficient for rubber wheels. `until` is the tick at which the change ends; inf if it never ends.
    """

    outline: Polygon
    friction: float
    until: float = math.inf


def disc_outline(center: tuple[float, float], radius: float) -> Polygon:
    """Return a polygon with DISC_CORNERS corners on the circle around `center` (x, y in m) with `radius` in m."""
    turns = [2 * math.pi * k / DISC_CORNERS for k in range(DISC_CORNERS)]
    return tuple((center[0] + radius * math.cos(turn), center[1] + radius * math.sin(turn)) for turn in turns)


Behavior = Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"]
"""Reaction of a pedestrian to robots, with the names of HuNavSim."""
Ignorable = Literal["robots", "people", "objects"]
"""Obstacles that a pedestrian can ignore; "people" are other pedestrians."""
Repeat = Literal["once", "loop", "back_and_forth"]
"""Behavior of a pedestrian after its last goal: stay, walk to the first goal again, or walk back through the goals."""

PEDESTRIAN_HEIGHT_M = 1.7
"""Default height of the upright cylinder that represents a pedestrian."""


@dataclass(frozen=True)
class WalkingPedestrian:
    """Pedestrian that starts at rest at `pose` and walks to `goals` (x, y in m) one after the other.

    `speed` is the preferred speed in m/s. `radius` and `height` of the body are in m. Pedestrians of the same `group`
    stay together. `blind_to` contains the obstacles that the pedestrian ignores. A `behavior` other than regular and
    impassive is a reaction. A reaction begins if a robot is within `reacts_within` m. All reactions together last for
    `reacts_for` s, but the reactions of a scared pedestrian are not limited.
    """

    name: str
    pose: Pose2
    goals: tuple[tuple[float, float], ...] = ()
    repeat: Repeat = "once"
    speed: float = 1.3
    radius: float = 0.25
    height: float = PEDESTRIAN_HEIGHT_M
    behavior: Behavior = "regular"
    group: str | None = None
    blind_to: frozenset[Ignorable] = frozenset()
    reacts_within: float = 0.0
    reacts_for: float = 0.0


@dataclass(frozen=True)
class PedestrianEvent:
    """Event of the pedestrian `name`: it reached a goal, began to react to a robot, or ended its reaction (calmed).

    `goal_or_robot` is the number of the goal, counted from 1, as text, or the name of the robot.
    """

    name: str
    kind: Literal["reached", "reacted", "calmed"]
    goal_or_robot: str
