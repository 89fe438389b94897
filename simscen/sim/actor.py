"""One thing that moves, and which of them are about a place."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from simscen.core.geometry import Pose3
from simscen.core.motion_path import Track
from simscen.core.shapes import Body, Mesh, MotionPath

Vector = tuple[float, float, float]
Placing = tuple[Vector, tuple[float, float, float, float]]


@dataclass
class Actor:
    """A body in the engine: `shown` is where the engine has it, `path` began at tick `since`.

    `speed` is the fastest that any part of it ever moves along its path, in m/s, `size` how far from its origin it
    extends, and `radius` how far from its axis, in metres. Where the engine has it as a surface without an inside,
    `surface` is that, in the body's frame.
    """

    id: int
    body: Body
    centre_from_base: Pose3
    shown: Pose3
    path: MotionPath | None
    since: int
    speed: float
    size: float
    radius: float
    surface: Mesh | None
    placed: tuple[Placing, Pose3] | None = None
    """What the engine last said of its centre of mass, and the pose that comes of it."""
    resting: bool = False
    """Whether it has not moved at all since the engine was asked before."""
    led: bool = False
    """Whether it may be given another path at any time."""
    track: Track | None = None
    """Its path as it is asked for."""
    scripted: dict[int, Pose3] = field(default_factory=dict)
    """Where its path has it at the ticks that were asked for last."""

    @property
    def pushable(self) -> bool:
        """Whether the engine moves it, rather than a script or nothing."""
        return self.body.mass > 0 and self.path is None

    def parked(self, since: float, seconds: float) -> bool:
        """Whether its path, set off `since` seconds ago, leaves it where it is for so many more."""
        if self.path is None or self.led:
            return False
        return self.path.over(since) or since + seconds < self.path.start


class About(NamedTuple):
    """The actors that at a tick were within a distance in metres of a place, and all that may be pushed unless asleep.

    `asleep` is since when all of those have been lying still; None where they have not. `lying` are number, place and
    size of each, where none of these moves.
    """

    actors: tuple[Actor, ...]
    place: Vector
    distance: float
    tick: int
    asleep: int | None
    lying: tuple[tuple[int, Vector, float], ...] | None

    def holds(self, place: Vector, distance: float, tick: int, step: float) -> bool:
        """Whether no other can be within a distance of a place at a tick, moving `step` metres a tick at most."""
        return math.dist(place, self.place) + step * (tick - self.tick) + distance <= self.distance
