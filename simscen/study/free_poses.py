"""Where a robot may start and where it may be sent: poses drawn from the free space of a world."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from simscen.core.chance import Streams
from simscen.core.geometry import Pose2
from simscen.core.world import BuiltWorld
from simscen.worlds.shortest import ShortestWays

ROOM = 0.12
"""Metres between a robot's hull, as a disc, and the nearest wall, where it starts and where it is sent."""
MOVABLE = 1.5
"""Metres from a door or a thing that may move within which no drive begins or ends."""
TRIES = 2000


@dataclass(frozen=True)
class Errand:
    """A number, from where to where, and the length in metres of the shortest way of the robot between them."""

    number: int
    start: Pose2
    goal: Pose2
    length: float


def errands(built: BuiltWorld, radius: float, numbers: Iterable[int], least: float = 5.0) -> Iterator[Errand]:
    """A drive of a disc of `radius` metres for each number, none shorter than `least` metres; always the same for a
    number; none for a number of which TRIES draws find none.
    """
    ways = ShortestWays(built.mesh, built.world.bounds, radius + ROOM)
    free = np.argwhere(built.map.cells == 0)
    for number in numbers if len(free) else ():
        chance = Streams(number).generator("errand")
        for _ in range(TRIES):
            ends = built.map.centre_of(free[chance.integers(0, len(free), 2)]).tolist()
            start, goal = (Pose2(x, y, float(chance.uniform(-math.pi, math.pi))) for x, y in ends)
            if start.distance(goal) < least / 2 or any(_near(end, built) for end in (start, goal)):
                continue
            length = ways.length(start, goal)
            if math.isfinite(length) and length >= least:
                yield Errand(number, start, goal, length)
                break


def _near(pose: Pose2, built: BuiltWorld) -> bool:
    """Whether something that may move, of which the map knows nothing, is or may come there."""
    return any(math.hypot(pose.x - body.pose.x, pose.y - body.pose.y) < MOVABLE for body in built.world.bodies)
