"""Where a robot truly goes: from room to room, on shortest ways, as a person with a joystick would drive it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.bench.localization.buildings import Building, mesh_of
from simscen.core.geometry import Array, Pose2
from simscen.model.robot import WheelOdometry
from simscen.worlds.routes.shortest_paths import ShortestPaths

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
    ways = ShortestPaths(
        mesh_of(floor.walls, floor.glass, furniture), (0.0, 0.0, *floor.size), CLEARANCE, finest=FINEST
    )
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


def _corners(floor: Building, ways: ShortestPaths, chance: np.random.Generator, alternate: bool) -> Iterator[Array]:
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
    """Poses (k, 3) half a meter apart on ways from room to room of an empty floor, none left out that has a door."""
    ways = ShortestPaths(mesh_of(floor.walls, floor.glass), (0.0, 0.0, *floor.size), CLEARANCE, finest=FINEST)
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


STUMBLES_EACH = 25.0
"""Seconds between two stretches of slipping wheels, on average."""
STUMBLE = (0.3, 1.5)
"""Seconds that one lasts."""


@dataclass(frozen=True)
class Wheels:
    """Standard deviations, over bases, of the constant errors of dead reckoning; whether wheels slip besides.

    `scale` of distances (wheels' radius), `turn` of angles (wheel base), `bend` in rad/m (wheels of unequal size):
    Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots, T-RA 12 (1996).
    """

    scale: float = 0.015
    turn: float = 0.03
    bend: float = 0.015
    slips: bool = True


CLEAN = Wheels(0.0, 0.0, 0.0, False)
"""Wheels with nothing but the random errors of the simulator's sensor."""


def reckoned(truth: Array, seconds: float, wheels: Wheels, spec: WheelOdometry, chance: np.random.Generator) -> Array:
    """Poses (k, 3) in the odom frame for true poses (k, 3), `seconds` apart."""
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(Pose2(*row) for row in truth))])
    way = np.hypot(steps[:, 0], steps[:, 1])
    scale, turn, bend = (
        1 + chance.normal(0, wheels.scale),
        1 + chance.normal(0, wheels.turn),
        chance.normal(0, wheels.bend),
    )
    along, around = chance.standard_normal((2, len(steps)))
    stretch = scale * _slip(len(steps), seconds, wheels.slips, chance)
    stretch[way > 0] += spec.translation_noise * along[way > 0] / np.sqrt(way[way > 0])
    heading = np.sqrt(spec.rotation_noise**2 * np.abs(steps[:, 2]) + spec.drift_noise**2 * way)
    spun = _slip(len(steps), seconds, wheels.slips, chance)
    turned = steps[:, 2] * turn * spun + bend * way + heading * around
    poses = [Pose2(0.0, 0.0, 0.0)]
    for x, y, yaw in np.column_stack((steps[:, 0] * stretch, steps[:, 1] * stretch, turned))[1:].tolist():
        poses.append(poses[-1].compose(Pose2(x, y, yaw)))
    return np.array(poses)


def _slip(count: int, seconds: float, slips: bool, chance: np.random.Generator) -> Array:
    """How much further than the base the wheels turn (count,): 1, and for short stretches 0.9 … 1.4."""
    factor = np.ones(count)
    if not slips:
        return factor
    row = int(chance.exponential(STUMBLES_EACH) / seconds)
    while row < count:
        end = row + max(1, int(chance.uniform(*STUMBLE) / seconds))
        factor[row:end] = chance.uniform(0.9, 1.4)
        row = end + int(chance.exponential(STUMBLES_EACH) / seconds)
    return factor
