"""Where a robot truly goes: from room to room, on shortest ways, as a person with a joystick would drive it."""

from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.study.indoor.boxes import mesh_of
from simscen.study.indoor.building import Building
from simscen.worlds.shortest import ShortestWays

STEP = 0.075
"""Seconds between two poses, and between two readings of the odometry."""
CLEARANCE = 0.35
"""m that the robot's middle keeps from everything."""
SPEED, TURN_RATE = 0.6, 1.0
"""m/s and rad/s: the most."""
FINEST = 0.1
"""m; cells of the search for ways."""
MOST_FAILURES = 30
"""Places in rooms that are tried as the next goal."""


class ShutIn(ValueError):
    """No way leads out of the room in which the drive would begin."""


def drive(floor: Building, furniture: Array, seconds: float, chance: np.random.Generator, alternate: bool) -> Array:
    """True poses (k, 3), STEP apart, between rooms drawn anywhere; if `alternate`, in the left half and the right one.

    Such a drive begins in the left half.
    """
    ways = ShortestWays(mesh_of(floor.walls, floor.glass, furniture), (0.0, 0.0, *floor.size), CLEARANCE, finest=FINEST)
    corners = _corners(floor, ways, chance, alternate)
    before, goal = next(corners), next(corners)
    x, y = before.tolist()
    pose = Pose2(x, y, float(np.arctan2(*(goal - before)[::-1])))
    truth: list[Pose2] = []
    while len(truth) < seconds / STEP:
        truth.append(pose)
        if np.hypot(*(goal - pose[:2])) < 0.15:
            goal = next(corners)
        x, y, _ = pose.between(Pose2(*goal))
        error = float(np.arctan2(y, x))
        turn = float(np.clip(2 * error, -TURN_RATE, TURN_RATE)) * STEP
        ahead = min(SPEED * STEP, float(np.hypot(x, y))) * max(0.0, float(np.cos(error))) ** 16
        pose = pose.compose(Pose2(ahead * np.cos(turn / 2), ahead * np.sin(turn / 2), turn))
    return np.array(truth)


def _corners(floor: Building, ways: ShortestWays, chance: np.random.Generator, alternate: bool) -> Iterator[Array]:
    """Places to turn at, without end, on the shortest ways between places in rooms."""
    here: Array | None = None
    right, failed = False, 0
    while True:
        side = (floor.rooms[:, 0] > floor.middle) == right
        rooms = floor.rooms[side] if alternate else floor.rooms
        target = rooms[chance.integers(len(rooms))] + chance.normal(0, 0.8, 2)
        start = target if here is None else here
        way = ways.way(Pose2(*start), Pose2(*target))
        failed = failed + 1 if way is None else 0
        if failed > MOST_FAILURES:  # furniture stands before the door of this room
            raise ShutIn(tuple(start))
        if way is not None:
            yield from way[:1] if here is None else way[1:]
            here, right = way[-1], not right


def tour(floor: Building) -> Array:
    """Poses (k, 3) half a metre apart on ways from room to room of an empty floor, none left out that has a door."""
    ways = ShortestWays(mesh_of(floor.walls, floor.glass), (0.0, 0.0, *floor.size), CLEARANCE, finest=FINEST)
    order = floor.rooms[np.argsort(floor.rooms[:, 0], kind="stable")]
    places, here = [order[:1]], order[0]
    for room in order[1:]:
        way = ways.way(Pose2(*here), Pose2(*room))
        if way is None:
            continue
        far = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
        at = np.arange(0.0, far[-1], 0.5)
        places.append(np.column_stack([np.interp(at, far, axis) for axis in way.T]))
        here = room
    found = np.concatenate(places)
    return np.column_stack((found, np.zeros(len(found))))
