"""Sensor readings, and their conversion to level scans and to the base frame.

Each reading contains the name of the `sensor` in the robot file, and the `tick` of the measurement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2, Pose3, rotate_vector
from simscen.core.geometry.kinematics import Twist

if TYPE_CHECKING:
    import numpy.typing as npt


PoseCovariance = tuple[float, float, float, float, float, float, float, float, float]
"""Covariance of x, y (m) and yaw (rad), row by row."""
UNKNOWN_POSE_COVARIANCE: PoseCovariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Covariance of a pose whose uncertainty is unknown: all zeros, as in ROS."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Planar lidar scan.

    Attributes:
        ranges: Range (n,) of each beam in m. As in REP 117, inf if nothing was hit up to `range_max`, -inf if a hit is
            closer than `range_min`, and nan if the measurement is invalid.
        angle_min: Direction of the first beam in the lidar frame in rad.
        angle_increment: Angle between consecutive beams in rad.
        mount: Pose of the lidar frame in the base frame, projected on the ground plane.
        tilted_mount: Pose of the lidar frame in the base frame in 3D; None for a level lidar.
    """

    sensor: str
    tick: int
    ranges: Array
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: Pose2 = Pose2(0.0, 0.0, 0.0)
    tilted_mount: Pose3 | None = None

    def angles(self) -> Array:
        """Return the beam directions (n,) in the lidar frame in rad."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)

    def points(self) -> Array:
        """Return x and y (k, 2) of the valid hits in m in the base frame. Ranges outside of the limits are left out."""
        hit = np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges <= self.range_max)
        angles, ranges = self.angles()[hit], self.ranges[hit]
        flat = np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles)))
        if self.tilted_mount is not None:
            return self.tilted_mount.apply(np.column_stack((flat, np.zeros(len(flat)))))[:, :2]
        return self.mount.apply(flat)


@fast_dataclass()
class Odometry:
    """Odometry: `pose` in the odom frame, and `twist` in the base frame.

    `twist_variance` contains the variances of vx, vy and wz. `pose_covariance` is in the odom frame. As in ROS, all
    zeros mean unknown.
    """

    sensor: str
    tick: int
    pose: Pose2
    twist: Twist
    twist_variance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pose_covariance: PoseCovariance = UNKNOWN_POSE_COVARIANCE


@fast_dataclass()
class Imu:
    """Reading of an IMU: angular velocity (rad/s) and acceleration (m/s²) along x, y, z of the sensor frame.

    The acceleration of a sensor at rest is 1 g upwards. `mount` is the pose of the sensor frame in the base frame. The
    variances describe the white noise of each axis, without the bias; 0 if unknown, as in ROS.
    """

    sensor: str
    tick: int
    angular_velocity: tuple[float, float, float]
    linear_acceleration: tuple[float, float, float]
    angular_velocity_variance: float = 0.0
    linear_acceleration_variance: float = 0.0
    mount: Pose3 = Pose3()


@fast_dataclass()
class Bump:
    """Reading of a bumper, which is `pressed` if the robot touches something."""

    sensor: str
    tick: int
    pressed: bool


@dataclass(frozen=True, eq=False)
class Image:
    """Image of a depth camera: `rgb` (h, w, 3), and `depth` (h, w) in m along the optical axis, inf if nothing was hit.

    `mount` is the pose of the camera in the base frame; the camera looks along its x axis. `field_of_view` is the
    horizontal angle in rad; 0 if unknown. Pixels are square.
    """

    sensor: str
    tick: int
    rgb: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    mount: Pose3 = Pose3()
    field_of_view: float = 0.0


Reading = Scan | Odometry | Imu | Bump | Image
Readings = tuple[Reading, ...]


MIN_HEIGHT_M = 0.05
"""Minimum height above the ground of hits that `level_scan` uses.

For a lidar lower than twice this height, the minimum is half the height of the lidar.
"""
MAX_HEIGHT_M = 2.0
"""Maximum height above the ground of hits that `level_scan` uses: `max_obstacle_height` of Nav2's costmap."""


def level_scan(scan: Scan) -> Scan:
    """Convert the scan of a tilted lidar to the scan of a level lidar at the same position.

    As in pointcloud_to_laserscan, each level beam gets the nearest hit in its direction. Hits below MIN_HEIGHT_M, above
    MAX_HEIGHT_M, or outside the angles of the level scan are ignored. A hit closer than `range_min` (-inf) counts as
    the nearest. The range is inf in directions in which nothing was hit, and nan in directions without a measurement,
    or in which all hits are ignored.
    A scan without `tilted_mount` is returned unchanged.
    """
    if scan.tilted_mount is None:
        return scan
    count = len(scan.ranges)
    first, increment, beams, flat, slopes = _level_beams(
        scan.tilted_mount, scan.mount.yaw, scan.angle_min, scan.angle_increment, count
    )
    height = scan.tilted_mount.z
    with np.errstate(invalid="ignore"):
        heights = height + np.where(np.isfinite(scan.ranges), scan.ranges, 0.0) * slopes
        is_obstacle = (heights >= min(MIN_HEIGHT_M, height / 2)) & (heights <= MAX_HEIGHT_M)
        ranges = np.where(is_obstacle | np.isinf(scan.ranges), scan.ranges * flat, np.nan)
    level = np.full(count, np.nan)
    order = np.argsort(-ranges)  # so that the nearest of several hits remains
    order = order[~np.isnan(ranges[order]) & (beams[order] < count)]
    level[beams[order]] = ranges[order]
    return replace(scan, ranges=level, angle_min=first, angle_increment=increment, tilted_mount=None)


def imu_in_base_frame(imu: Imu) -> Imu:
    """Rotate a reading to the axes of the base frame. The acceleration remains that of the sensor's position."""
    at_base = Pose3()
    if imu.mount == at_base:
        return imu
    quaternion = imu.mount.quaternion
    return replace(
        imu,
        angular_velocity=rotate_vector(quaternion, imu.angular_velocity),
        linear_acceleration=rotate_vector(quaternion, imu.linear_acceleration),
        mount=at_base,
    )


@lru_cache(maxsize=16)
def _level_beams(
    mount: Pose3, yaw: float, first: float, increment: float, count: int
) -> tuple[float, float, Array, Array, Array]:
    """Return angle_min and angle_increment of the level scan, and three arrays (count,) for the tilted beams.

    The arrays contain the index of the level beam in the same direction (`count` if there is none), and the horizontal
    and vertical components of the unit vector along the tilted beam. The tilted beams have the angles `first` + k
    `increment` in rad. `yaw` is the heading of the level lidar in the base frame.
    """
    rotation = mount.rotation()
    angles = first + increment * np.arange(count, dtype=np.float64)
    x, y, z = rotation[:, :2] @ np.array((np.cos(angles), np.sin(angles)))
    last = first + increment * (count - 1)
    lowest = min(first, last) if rotation[2, 2] >= 0 else min(-first, -last)
    step = abs(increment) or 1.0
    offsets = np.remainder(np.arctan2(y, x) - yaw - lowest + step / 2, 2 * math.pi) - step / 2
    beams = np.minimum(np.rint(offsets / step), count - 1).astype(np.int64)
    beams[offsets / step > count - 0.5 + 1e-6] = count
    return lowest, step, beams, np.hypot(x, y), z
