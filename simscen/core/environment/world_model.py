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


Behavior = Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"]
"""How somebody takes the robot (HuNavSim's names)."""
Unseen = Literal["robots", "people", "objects"]
Repeat = Literal["once", "loop", "back_and_forth"]

BODY_HEIGHT = 1.7
"""m; a body is an upright cylinder."""


@dataclass(frozen=True)
class WalkingPedestrian:
    """Somebody called `name` who starts at rest at `pose` and walks to `goals` (x, y) in turn, in meters.

    `speed` in m/s is the one they like best, `radius` and `height` those of their body in meters. Those of one `group`
    keep together. `blind_to` is what they take no notice of. `reacts_within` meters and `reacts_for` seconds say when
    a behavior other than regular and impassive begins and how long it lasts.
    """

    name: str
    pose: Pose2
    goals: tuple[tuple[float, float], ...] = ()
    repeat: Repeat = "once"
    speed: float = 1.3
    radius: float = 0.25
    height: float = BODY_HEIGHT
    behavior: Behavior = "regular"
    group: str | None = None
    blind_to: frozenset[Unseen] = frozenset()
    reacts_within: float = 0.0
    reacts_for: float = 0.0


@dataclass(frozen=True)
class PedestrianAction:
    """Something a person did: `what` is reached, reacted or calmed.

    `about` is the number of the goal (from 1), or the robot.
    """

    name: str
    what: Literal["reached", "reacted", "calmed"]
    about: str
