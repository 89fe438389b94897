"""Where a robot truly goes: from room to room, on shortest ways, as a person with a joystick would drive it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.bench.localization.buildings import HEIGHT, Building, mesh_of
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.model.robot import Lidar, WheelOdometry
from simscen.worlds.raycasting.ray_scene import RayScene
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


def drive(floor: Building, furniture: Array, seconds: float, rng: np.random.Generator, alternate: bool) -> Array:
    """True poses (k, 3), STEP apart, between rooms drawn anywhere; if `alternate`, in the left half and the right one.

    Such a drive begins in the left half.
    """
    ways = ShortestPaths(
        mesh_of(floor.walls, floor.glass, furniture), (0.0, 0.0, *floor.size), CLEARANCE, finest=FINEST
    )
    corners = _corners(floor, ways, rng, alternate)
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


def _corners(floor: Building, ways: ShortestPaths, rng: np.random.Generator, alternate: bool) -> Iterator[Array]:
    """Places to turn at, without end, on the shortest ways between places in rooms."""
    here: Array | None = None
    right, failed = False, 0
    while True:
        side = (floor.rooms[:, 0] > floor.middle) == right
        rooms = floor.rooms[side] if alternate else floor.rooms
        target = rooms[rng.integers(len(rooms))] + rng.normal(0, 0.8, 2)
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


def reckoned(truth: Array, seconds: float, wheels: Wheels, spec: WheelOdometry, rng: np.random.Generator) -> Array:
    """Poses (k, 3) in the odom frame for true poses (k, 3), `seconds` apart."""
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(Pose2(*row) for row in truth))])
    way = np.hypot(steps[:, 0], steps[:, 1])
    scale, turn, bend = (
        1 + rng.normal(0, wheels.scale),
        1 + rng.normal(0, wheels.turn),
        rng.normal(0, wheels.bend),
    )
    along, around = rng.standard_normal((2, len(steps)))
    stretch = scale * _slip(len(steps), seconds, wheels.slips, rng)
    stretch[way > 0] += spec.translation_noise * along[way > 0] / np.sqrt(way[way > 0])
    heading = np.sqrt(spec.rotation_noise**2 * np.abs(steps[:, 2]) + spec.drift_noise**2 * way)
    spun = _slip(len(steps), seconds, wheels.slips, rng)
    turned = steps[:, 2] * turn * spun + bend * way + heading * around
    poses = [Pose2(0.0, 0.0, 0.0)]
    for x, y, yaw in np.column_stack((steps[:, 0] * stretch, steps[:, 1] * stretch, turned))[1:].tolist():
        poses.append(poses[-1].compose(Pose2(x, y, yaw)))
    return np.array(poses)


def _slip(count: int, seconds: float, slips: bool, rng: np.random.Generator) -> Array:
    """How much further than the base the wheels turn (count,): 1, and for short stretches 0.9 … 1.4."""
    factor = np.ones(count)
    if not slips:
        return factor
    row = int(rng.exponential(STUMBLES_EACH) / seconds)
    while row < count:
        end = row + max(1, int(rng.uniform(*STUMBLE) / seconds))
        factor[row:end] = rng.uniform(0.9, 1.4)
        row = end + int(rng.exponential(STUMBLES_EACH) / seconds)
    return factor


# MERGED: People who walk about a floor.
WANDERS = 2.5
"""m: how far from the middle of a room people who are in it walk, and from the corridor's middle never."""


def people_in(floor: Building, count: int, seconds: float, people: int, rng: np.random.Generator) -> Array:
    """Poses (count, people, 3), `seconds` apart: half of them up and down the corridor, the others about in rooms.

    Nobody gets out of the robot's way, and they walk through furniture.
    """
    times = np.arange(count) * seconds
    corridor = float(np.median(floor.doors[:, 1]))
    tracks = []
    for person in range(people):
        if person % 2:
            ends = np.array([[2.0, corridor], [floor.size[0] - 2.0, corridor]]) + rng.normal(0, 0.2, (2, 2))
        else:
            middle = floor.rooms[rng.integers(len(floor.rooms))]
            ends = middle + rng.uniform(-WANDERS, WANDERS, (2, 2)) / 2
        apart = float(np.hypot(*(ends[1] - ends[0])))
        walked = times * WALKING * rng.uniform(0.4, 1.2) + rng.uniform(0, 2 * apart)
        back = walked % (2 * apart) > apart
        along = np.abs(walked % (2 * apart) - 2 * apart * back)
        heading = np.arctan2(*(ends[1] - ends[0])[::-1]) + np.pi * back
        places = ends[0] + np.outer(along / apart, ends[1] - ends[0])
        tracks.append(np.column_stack((places, heading)))
    return np.stack(tracks, axis=1)


LEG, STRIDE = 0.07, 0.14
"""m: the radius of a leg, and how far legs are from the middle between them."""
WALKING = 1.1
"""m/s."""
THROUGH = 0.8
"""Share of the beams that go through glass."""


@dataclass(frozen=True, eq=False)
class Sight:
    """What there is to see: without glass and with it."""

    opaque: RayScene
    all: RayScene

    @classmethod
    def of(cls, opaque: TriangleMesh, everything: TriangleMesh) -> "Sight":
        """Of two meshes."""
        return cls(RayScene(opaque), RayScene(everything))

    def distances(self, poses: Array, angles: Array, reach: float, rng: np.random.Generator) -> Array:
        """True ranges (n, b) from `poses` (n, 3) of the lidar along `angles` (b,); inf beyond `reach`."""
        heading = (poses[:, 2:] + angles).ravel()
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), np.full(len(heading), HEIGHT / 2)))
        directions = np.column_stack((np.cos(heading), np.sin(heading), np.zeros(len(heading))))
        seen, behind = (scene.cast(origins, directions, reach) for scene in (self.all, self.opaque))
        through = rng.random(len(heading)) < THROUGH
        distances: Array = np.where(through, behind, seen).reshape(len(poses), len(angles))
        return distances


def angles_of(spec: Lidar) -> Array:
    """Directions (b,) of the beams in the lidar's frame."""
    full = spec.field_of_view >= 2 * np.pi - 1e-9
    increment = spec.field_of_view / (spec.beams if full else spec.beams - 1)
    angles: Array = -spec.field_of_view / 2 + increment * np.arange(spec.beams, dtype=np.float64)
    return angles


def hidden_by(people: Array, poses: Array, angles: Array, ranges: Array) -> Array:
    """Ranges (n, b) where `people` (n, p, 3) x, y, heading stand in the way of beams from `poses` (n, 3)."""
    aside = np.stack((-np.sin(people[..., 2]), np.cos(people[..., 2])), axis=-1) * STRIDE
    legs = np.concatenate((people[..., :2] + aside, people[..., :2] - aside), axis=1) - poses[:, None, :2]
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    seen: Array = np.array(ranges)
    for leg in range(legs.shape[1]):
        x, y = legs[:, leg, :1], legs[:, leg, 1:]
        near = np.hypot(x, y)[:, 0] < 15.0
        ahead = c[near] * x[near] + s[near] * y[near]
        inside = LEG**2 - np.square(x[near]) - np.square(y[near]) + np.square(ahead)
        hit = np.where((inside >= 0) & (ahead > 0), ahead - np.sqrt(np.maximum(inside, 0)), np.inf)
        seen[near] = np.minimum(seen[near], np.where(hit > 0, hit, np.inf))
    return seen


def measured(distances: Array, spec: Lidar, rng: np.random.Generator) -> Array:
    """What the electronics make of true distances: the simulator's lidar."""
    ranges: Array = (
        np.round((distances + rng.normal(0, spec.noise, distances.shape)) / spec.resolution) * spec.resolution
    )
    ranges[ranges > spec.max_range] = np.inf
    ranges[ranges < spec.min_range] = -np.inf
    return ranges
