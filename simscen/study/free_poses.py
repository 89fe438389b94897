"""Where a robot may start and where it may be sent: poses drawn from the free space of a world."""

import math
from collections.abc import Iterator
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
    """From where to where, and the length in metres of the shortest way of the robot between them."""

    start: Pose2
    goal: Pose2
    length: float


def errands(built: BuiltWorld, radius: float, count: int, seed: int, least: float = 5.0) -> Iterator[Errand]:
    """`count` drives of a disc of `radius` metres, none shorter than `least` metres; always the same for a seed.

    Fewer where TRIES draws do not find as many.
    """
    chance = Streams(seed).generator("errands")
    grid = built.map
    ways = ShortestWays(built.mesh, built.world.bounds, radius + ROOM)
    free = np.argwhere(grid.cells == 0)
    found = 0
    for _ in range(TRIES if len(free) else 0):
        if found == count:
            return
        ends = grid.centre_of(free[chance.integers(0, len(free), 2)]).tolist()
        start, goal = (Pose2(x, y, float(chance.uniform(-math.pi, math.pi))) for x, y in ends)
        if start.distance(goal) < least / 2 or any(_near(end, built) for end in (start, goal)):
            continue
        length = ways.length(start, goal)
        if math.isfinite(length) and length >= least:
            found += 1
            yield Errand(start, goal, length)


def _near(pose: Pose2, built: BuiltWorld) -> bool:
    """Whether something that may move, of which the map knows nothing, is or may come there."""
    return any(math.hypot(pose.x - body.pose.x, pose.y - body.pose.y) < MOVABLE for body in built.world.bodies)
