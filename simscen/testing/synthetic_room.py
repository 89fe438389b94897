"""Drives of a robot through one asymmetric room, and their noisy sensor readings, for tests of localizers."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.localizers import LocalizerSpec
from simscen.stack.protocols import Localizer, RobotModel, Surroundings
from simscen.stack.setting import Setting

TICK_RATE_HZ, ODOMETRY_PERIOD_TICKS, SCAN_PERIOD_TICKS = 240, 6, 24
READINGS_PER_SCAN = SCAN_PERIOD_TICKS // ODOMETRY_PERIOD_TICKS
"""Number of odometry readings per scan."""
RANGE_MAX_M, BEAMS = 12.0, 360
"""Maximum range and number of beams of the lidar."""
BOXES = np.array([
    (-5.07, -4.03, 5.12, -3.87), (-5.07, 3.91, 5.12, 4.06), (-5.07, -4.03, -4.88, 4.06), (4.93, -4.03, 5.12, 4.06),
    (-1.13, 1.62, -0.88, 4.06), (-5.07, -0.52, -3.31, -0.29), (2.21, -2.44, 3.02, -1.17), (1.37, 2.73, 2.96, 3.34),
    (-2.52, -4.03, -1.49, -3.06), (3.58, 0.71, 4.93, 1.29), (-3.52, 2.18, -3.07, 2.61),
])  # fmt: skip
"""Boxes (left, bottom, right, top) in m: four outer walls, and obstacles in the room."""
WAYPOINTS = ((-2.5, -1.8), (0.8, -2.9), (0.9, -0.4), (3.9, -0.2), (2.6, 1.7), (0.3, 2.4), (0.1, 0.6), (-2.2, 1.0),
         (-2.0, 3.2), (-4.2, 3.0), (-4.1, 0.8), (-2.4, 0.2))  # fmt: skip
"""Waypoints (x, y) in m of a drive. After the last waypoint, the first waypoint follows again."""
ROBOT = RobotModel(
    footprint=((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)),
    radius=0.2,
    max_linear=0.5,
    max_reverse=0.2,
    max_lateral=0.0,
    max_angular=1.5,
    linear_acceleration=1,
    linear_deceleration=1,
    angular_acceleration=3,
)
"""Robot that drives through the room."""


@cache
def grid(resolution: float = 0.05) -> OccupancyGrid:
    """Return the map of the room with cells of `resolution` in m. Cells that touch an obstacle are occupied."""
    x = np.arange(-5.2 + resolution / 2, 5.2, resolution)
    y = np.arange(-4.2 + resolution / 2, 4.2, resolution)[:, None]
    half = resolution / 2
    box_count = sum((x + half > b[0]) & (x - half < b[2]) & (y + half > b[1]) & (y - half < b[3]) for b in BOXES)
    cells = np.where(np.asarray(box_count) > 0, OCCUPIED, FREE).astype(np.int8)
    return OccupancyGrid(cells, resolution, Pose2(-5.2, -4.2, 0.0))


def cast(poses: Array, angles: Array, boxes: Array = BOXES) -> Array:
    """Return exact ranges (n, b) in m to boxes, from lidar `poses` (n, 3) along beam `angles` (b,) in rad."""
    heading = poses[:, 2:] + angles
    with np.errstate(divide="ignore"):
        inverse = 1 / np.stack((np.cos(heading), np.sin(heading)), axis=-1)
    nearest = np.full(heading.shape, np.inf)
    for box in boxes:
        near, far = ((corner - poses[:, None, :2]) * inverse for corner in (box[:2], box[2:]))
        enter, leave = np.minimum(near, far).max(axis=-1), np.maximum(near, far).min(axis=-1)
        nearest = np.where((enter <= leave) & (enter > 0), np.minimum(nearest, enter), nearest)
    return nearest


@dataclass(frozen=True, eq=False)
class RoomDrive:
    """Drive through the room from tick 0, without noise.

    truth:  true poses (k, 3) at 40 Hz
    steps:  motions (k, 3) from the previous pose to each pose, in the base frame of the previous pose; 0 for the first
    ranges: exact ranges (ceil(k / 4), 360) of the scans at 10 Hz
    """

    truth: Array
    steps: Array
    ranges: Array


def drive_along(truth: Array) -> RoomDrive:
    """Return the drive along true poses (k, 3) at 40 Hz."""
    poses = [Pose2(*row) for row in truth]
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(poses))])
    angles = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS, dtype=np.float64)
    return RoomDrive(truth, steps, cast(truth[::READINGS_PER_SCAN], angles))


@cache
def drive(seconds: float, first: int = 0) -> RoomDrive:
    """Return a drive along WAYPOINTS at up to 0.5 m/s and 1 rad/s. `first` is the index of the start waypoint."""
    dt, pose, goal = ODOMETRY_PERIOD_TICKS / TICK_RATE_HZ, Pose2(*WAYPOINTS[first], 0.0), first + 1
    truth = [pose]
    for _ in range(round(seconds / dt)):
        waypoint = Pose2(*WAYPOINTS[goal % len(WAYPOINTS)])
        goal += pose.distance(waypoint) < 0.3
        x, y, _ = pose.between(waypoint)
        error = np.arctan2(y, x)
        turn, forward = np.clip(2 * error, -1, 1) * dt, 0.5 * max(0.0, np.cos(error)) ** 4 * dt
        pose = pose.compose(Pose2(forward * np.cos(turn / 2), forward * np.sin(turn / 2), turn))
        truth.append(pose)
    return drive_along(np.array(truth))


def surroundings() -> Surroundings:
    """Return the robot, map, and tick rate for a localizer."""
    return Surroundings(ROBOT, grid(), TICK_RATE_HZ)


def build_localizer(spec: LocalizerSpec, estimate: Estimate, seed: int) -> Localizer:
    """Build the localizer of a specification for the room. `estimate` is the initial pose estimate."""
    setting = Setting(surroundings(), "localizer", Streams(seed), estimate=estimate)
    localizer: Localizer = spec.implementation()(spec, setting)
    return localizer


@dataclass(frozen=True)
class Noise:
    """Standard deviations of sensor errors.

    lidar:                 ranges in m
    translation:           distance of the odometry in m, after 1 m
    rotation:              yaw of the odometry in rad, after a turn by 1 rad
    drift:                 yaw of the odometry in rad, after 1 m
    gyro:                  yaw rate in rad/s
    gyro_bias:             constant error of the yaw rate in rad/s

    The standard deviation of odometry errors grows with the square root of the distance or turn.
    """

    lidar: float = 0.01
    translation: float = 0.01
    rotation: float = 0.01
    drift: float = 0.005
    gyro: float = 0.002
    gyro_bias: float = 0.0005


DEFAULT_NOISE = Noise()


def run_localizer(
    subject: Localizer, drive: RoomDrive, seed: int, noise: Noise = DEFAULT_NOISE, *, imu: bool = False
) -> list[Belief]:
    """Send noisy readings of the drive to a localizer, and return the belief after each odometry reading.

    With `imu`, the localizer also receives yaw rates.
    """
    rng, beliefs = np.random.default_rng((seed, 2)), []
    ranges = drive.ranges + rng.normal(0, noise.lidar, drive.ranges.shape)
    ranges = np.where(ranges < RANGE_MAX_M, np.round(ranges, 3), np.inf)
    odometry, bias = Pose2(0, 0, 0), rng.normal(0, noise.gyro_bias)
    for row, step in enumerate(drive.steps):
        tick, distance = row * ODOMETRY_PERIOD_TICKS, float(np.hypot(step[0], step[1]))
        heading_std = np.sqrt(noise.rotation**2 * abs(step[2]) + noise.drift**2 * distance)
        scale = 1 + rng.normal() * noise.translation * np.sqrt(distance) / max(distance, 1e-9)
        odometry = odometry.compose(Pose2(step[0] * scale, step[1] * scale, step[2] + rng.normal() * heading_std))
        if imu and row:
            rate = step[2] * TICK_RATE_HZ / ODOMETRY_PERIOD_TICKS + bias + rng.normal() * noise.gyro
            subject.on_imu(Imu("imu", tick, (0.0, 0.0, rate), (0.0, 0.0, 9.81)))
        subject.on_odometry(Odometry("odom", tick, odometry, Twist()))
        if tick % SCAN_PERIOD_TICKS == 0:
            subject.on_scan(scan(ranges[tick // SCAN_PERIOD_TICKS], tick))
        beliefs.append(subject.belief)
    return beliefs


def scan(ranges: Array, tick: int = 0, **changes: object) -> Scan:
    """Return a scan over 360 degrees of a lidar at the origin of the base frame. `changes` are other fields of Scan."""
    defaults = {
        "angle_min": -np.pi,
        "angle_increment": 2 * np.pi / max(len(ranges), 1),
        "range_min": 0.05,
        "range_max": RANGE_MAX_M,
    }
    return Scan("lidar", tick, ranges, **(defaults | changes))  # type: ignore[arg-type]


def pose_errors(beliefs: list[Belief], truth: Array) -> Array:
    """Return the errors (k, 3) of beliefs in x and y in m and yaw in rad, in the map frame. Yaw errors are wrapped."""
    error: Array = np.array([belief.pose for belief in beliefs]) - truth
    error[:, 2] = wrap_array(error[:, 2])
    return error


def nees(belief: Belief, error: Array) -> float:
    """Return the NEES of a belief with this pose error (3,); see Bar-Shalom et al. 2001, section 5.4."""
    return float(error @ np.linalg.solve(belief.covariance, error))
