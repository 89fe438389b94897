"""Simulation of a drive through a generated building: true poses, wheel odometry, people, and lidar ranges."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.bench.localization.buildings import HEIGHT_M, Building, extruded_mesh
from simscen.core.geometry import Array, Pose2
from simscen.model.sensors import Lidar, WheelOdometry
from simscen.worlds.raycasting.ray_scene import RayScene
from simscen.worlds.routes.shortest_paths import ShortestPaths

STEP_S = 0.075
"""Time between two true poses. There is one odometry message for each true pose."""
CLEARANCE_M = 0.35
"""Minimum distance of paths to walls and furniture."""
MAX_SPEED_M_S, MAX_TURN_RATE_RAD_S = 0.6, 1.0
SEARCH_CELL_M = 0.1
"""Cell size of the path search."""
MAX_FAILED_GOALS = 30
"""Maximum number of consecutive goals without a path before EnclosedStart is raised."""


class EnclosedStart(ValueError):
    """Furniture encloses the robot, so that no path leads to another room."""


def drive_between_rooms(
    floor: Building, furniture: Array, seconds: float, rng: np.random.Generator, alternates_halves: bool
) -> Array:
    """Return true poses (k, 3), STEP_S apart, of a drive along shortest paths between random rooms.

    With `alternates_halves`, the drive starts in the left half of the floor, and goals alternate between both halves.
    `furniture` are boxes (n, 4). Raises EnclosedStart.
    """
    mesh = extruded_mesh(floor.walls, floor.glass, furniture)
    paths = ShortestPaths(mesh, (0.0, 0.0, *floor.size), CLEARANCE_M, min_resolution=SEARCH_CELL_M)
    waypoints = _waypoints(floor, paths, rng, alternates_halves)
    start, goal = next(waypoints), next(waypoints)
    x, y = start.tolist()
    pose = Pose2(x, y, float(np.arctan2(*(goal - start)[::-1])))
    truth: list[Pose2] = []
    while len(truth) < seconds / STEP_S:
        truth.append(pose)
        if np.hypot(*(goal - pose[:2])) < 0.15:
            goal = next(waypoints)
        x, y, _ = pose.between(Pose2(*goal))
        error = float(np.arctan2(y, x))
        turn = float(np.clip(2 * error, -MAX_TURN_RATE_RAD_S, MAX_TURN_RATE_RAD_S)) * STEP_S
        # The power makes the robot nearly stop for turns, as a person with a joystick would drive.
        forward = min(MAX_SPEED_M_S * STEP_S, float(np.hypot(x, y))) * max(0.0, float(np.cos(error))) ** 16
        pose = pose.compose(Pose2(forward * np.cos(turn / 2), forward * np.sin(turn / 2), turn))
    return np.array(truth)


def _waypoints(
    floor: Building, paths: ShortestPaths, rng: np.random.Generator, alternates_halves: bool
) -> Iterator[Array]:
    """Yield endlessly the vertices (2,) of shortest paths between random points in rooms. Raises EnclosedStart."""
    position: Array | None = None
    is_right, failed_count = False, 0
    while True:
        in_half = (floor.rooms[:, 0] > floor.middle) == is_right
        rooms = floor.rooms[in_half] if alternates_halves else floor.rooms
        target = rooms[rng.integers(len(rooms))] + rng.normal(0, 0.8, 2)
        start = target if position is None else position
        path = paths.path(Pose2(*start), Pose2(*target))
        failed_count = failed_count + 1 if path is None else 0
        if failed_count > MAX_FAILED_GOALS:  # furniture blocks the door of this room
            raise EnclosedStart(tuple(start))
        if path is not None:
            yield from path[:1] if position is None else path[1:]
            position, is_right = path[-1], not is_right


def mapping_tour(floor: Building) -> Array:
    """Return poses (k, 3), 0.5 m apart and with yaw 0, on a path through all reachable rooms, ignoring furniture."""
    mesh = extruded_mesh(floor.walls, floor.glass)
    paths = ShortestPaths(mesh, (0.0, 0.0, *floor.size), CLEARANCE_M, min_resolution=SEARCH_CELL_M)
    order = floor.rooms[np.argsort(floor.rooms[:, 0], kind="stable")]
    points, position = [order[:1]], order[0]
    for room in order[1:]:
        path = paths.path(Pose2(*position), Pose2(*room))
        if path is None:
            continue
        length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
        samples = np.arange(0.0, length[-1], 0.5)
        points.append(np.column_stack([np.interp(samples, length, axis) for axis in path.T]))
        position = room
    tour = np.concatenate(points)
    return np.column_stack((tour, np.zeros(len(tour))))


MEAN_SLIP_INTERVAL_S = 25.0
"""Mean time from the end of one slip to the start of the next."""
SLIP_DURATION_RANGE_S = (0.3, 1.5)
"""Shortest and longest duration of a slip."""


@dataclass(frozen=True)
class OdometryErrors:
    """Standard deviations of systematic errors of wheel odometry. `simulate_odometry` draws the errors once per call.

    scale:      relative error of distances, caused by a wrong wheel radius
    turn:       relative error of rotations, caused by a wrong wheel separation
    bend:       curvature error in rad/m, caused by unequal wheels
    has_slip:   whether the wheels slip at random times

    See Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots, T-RA 12 (1996).
    """

    scale: float = 0.015
    turn: float = 0.03
    bend: float = 0.015
    has_slip: bool = True


RANDOM_ERRORS_ONLY = OdometryErrors(0.0, 0.0, 0.0, has_slip=False)
"""No systematic errors and no slip, only the random errors of WheelOdometry."""


def simulate_odometry(truth: Array, errors: OdometryErrors, rng: np.random.Generator) -> Array:
    """Return the odometry poses (k, 3) in the odom frame for true poses `truth` (k, 3) that are STEP_S apart.

    The random errors are those of the default WheelOdometry.
    """
    noise = WheelOdometry()
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(Pose2(*row) for row in truth))])
    distance = np.hypot(steps[:, 0], steps[:, 1])
    scale, turn, bend = 1 + rng.normal(0, errors.scale), 1 + rng.normal(0, errors.turn), rng.normal(0, errors.bend)
    translation_draws, rotation_draws = rng.standard_normal((2, len(steps)))
    stretch = scale * _slip_factors(len(steps), errors.has_slip, rng)
    moving = distance > 0
    stretch[moving] += noise.translation_noise * translation_draws[moving] / np.sqrt(distance[moving])
    heading_std = np.sqrt(noise.rotation_noise**2 * np.abs(steps[:, 2]) + noise.drift_noise**2 * distance)
    turn_slip = _slip_factors(len(steps), errors.has_slip, rng)
    turned = steps[:, 2] * turn * turn_slip + bend * distance + heading_std * rotation_draws
    poses = [Pose2(0.0, 0.0, 0.0)]
    for x, y, yaw in np.column_stack((steps[:, 0] * stretch, steps[:, 1] * stretch, turned))[1:].tolist():
        poses.append(poses[-1].compose(Pose2(x, y, yaw)))
    return np.array(poses)


def _slip_factors(count: int, has_slip: bool, rng: np.random.Generator) -> Array:
    """Return the ratio of wheel motion to robot motion for `count` steps of STEP_S.

    The ratio is 1 without slip, and random between 0.9 and 1.4 during a slip.
    """
    factor = np.ones(count)
    if not has_slip:
        return factor
    row = int(rng.exponential(MEAN_SLIP_INTERVAL_S) / STEP_S)
    while row < count:
        end = row + max(1, int(rng.uniform(*SLIP_DURATION_RANGE_S) / STEP_S))
        factor[row:end] = rng.uniform(0.9, 1.4)
        row = end + int(rng.exponential(MEAN_SLIP_INTERVAL_S) / STEP_S)
    return factor


WALKING_AREA_SIDE_M = 2.5
"""Side of the square around the center of a room in which a person walks."""
WALKING_SPEED_M_S = 1.1
"""Walking speed, which is multiplied by a random factor from 0.4 to 1.2 for each person."""


def simulate_people(
    floor: Building, time_count: int, interval: float, people_count: int, rng: np.random.Generator
) -> Array:
    """Return the poses (time_count, people_count, 3) of people at times that are `interval` seconds apart.

    Half of the people walk in the corridor, half in rooms. Each person walks back and forth on a random line, also
    through the robot and furniture.
    """
    times = np.arange(time_count) * interval
    corridor = float(np.median(floor.doors[:, 1]))
    tracks = []
    for person in range(people_count):
        if person % 2:
            ends = np.array([[2.0, corridor], [floor.size[0] - 2.0, corridor]]) + rng.normal(0, 0.2, (2, 2))
        else:
            center = floor.rooms[rng.integers(len(floor.rooms))]
            ends = center + rng.uniform(-WALKING_AREA_SIDE_M, WALKING_AREA_SIDE_M, (2, 2)) / 2
        length = float(np.hypot(*(ends[1] - ends[0])))
        walked = times * WALKING_SPEED_M_S * rng.uniform(0.4, 1.2) + rng.uniform(0, 2 * length)
        returning = walked % (2 * length) > length
        along = np.abs(walked % (2 * length) - 2 * length * returning)
        heading = np.arctan2(*(ends[1] - ends[0])[::-1]) + np.pi * returning
        points = ends[0] + np.outer(along / length, ends[1] - ends[0])
        tracks.append(np.column_stack((points, heading)))
    return np.stack(tracks, axis=1)


LEG_RADIUS_M, LEG_OFFSET_M = 0.07, 0.14
"""Radius of a leg, and distance of the leg from the center of the person."""
MAX_LEG_DISTANCE_M = 15.0
"""Distance from the lidar beyond which legs are ignored."""
GLASS_TRANSMISSION = 0.8
"""Probability that a beam passes through glass."""


class PartlyTransparentScene:
    """Ray caster for a building with glass. A beam passes through glass with the probability GLASS_TRANSMISSION."""

    def __init__(self, floor: Building, furniture: Array) -> None:
        """Take the floor, and boxes (n, 4) of the furniture that replaces the furniture of the floor."""
        self._opaque = RayScene(extruded_mesh(floor.walls, furniture))
        self._everything = RayScene(extruded_mesh(floor.walls, floor.glass, furniture))

    def distances(self, poses: Array, angles: Array, max_range: float, rng: np.random.Generator) -> Array:
        """Return true ranges (n, b) for lidar `poses` (n, 3) and beam `angles` (b,); inf beyond `max_range`."""
        heading = (poses[:, 2:] + angles).ravel()
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), np.full(len(heading), HEIGHT_M / 2)))
        directions = np.column_stack((np.cos(heading), np.sin(heading), np.zeros(len(heading))))
        with_glass = self._everything.cast(origins, directions, max_range)
        without_glass = self._opaque.cast(origins, directions, max_range)
        transmitted = rng.random(len(heading)) < GLASS_TRANSMISSION
        distances: Array = np.where(transmitted, without_glass, with_glass).reshape(len(poses), len(angles))
        return distances


def beam_angles(spec: Lidar) -> Array:
    """Return the angles (b,) in rad of the beams in the lidar frame."""
    increment = spec.field_of_view / (spec.beams - 1)
    angles: Array = -spec.field_of_view / 2 + increment * np.arange(spec.beams, dtype=np.float64)
    return angles


def occlude_by_people(people: Array, poses: Array, angles: Array, ranges: Array) -> Array:
    """Return the ranges (n, b) of scans among people. Beams that hit a leg end there.

    `people` (n, p, 3) are the poses of p people at the time of each scan, and `poses` (n, 3) the poses of the lidar.
    `angles` (b,) are the beam angles in rad, and `ranges` (n, b) the ranges in m without people.
    """
    offset = np.stack((-np.sin(people[..., 2]), np.cos(people[..., 2])), axis=-1) * LEG_OFFSET_M
    legs = np.concatenate((people[..., :2] + offset, people[..., :2] - offset), axis=1) - poses[:, None, :2]
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    result: Array = np.array(ranges)
    for leg in range(legs.shape[1]):
        x, y = legs[:, leg, :1], legs[:, leg, 1:]
        near = np.hypot(x, y)[:, 0] < MAX_LEG_DISTANCE_M
        along = c[near] * x[near] + s[near] * y[near]
        half_chord_squared = LEG_RADIUS_M**2 - np.square(x[near]) - np.square(y[near]) + np.square(along)
        hits = (half_chord_squared >= 0) & (along > 0)
        distance = np.where(hits, along - np.sqrt(np.maximum(half_chord_squared, 0)), np.inf)
        result[near] = np.minimum(result[near], np.where(distance > 0, distance, np.inf))
    return result


def add_lidar_noise(distances: Array, spec: Lidar, rng: np.random.Generator) -> Array:
    """Return noisy, rounded ranges for true `distances` in m; inf above `max_range`, -inf below `min_range`."""
    noisy = distances + rng.normal(0, spec.noise, distances.shape)
    ranges: Array = np.round(noisy / spec.resolution) * spec.resolution
    ranges[ranges > spec.max_range] = np.inf
    ranges[ranges < spec.min_range] = -np.inf
    return ranges
