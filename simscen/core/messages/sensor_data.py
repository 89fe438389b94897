"""Sensor readings. Each contains the instance name of its sensor and the tick at which it was taken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist

if TYPE_CHECKING:
    import numpy.typing as npt

PoseCovariance = tuple[float, float, float, float, float, float, float, float, float]
"""Covariance of x, y (m) and yaw (rad), row by row."""
UNKNOWN_POSE_COVARIANCE: PoseCovariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Scan:
    """Planar lidar scan.

    `ranges` (n,) are in m; by REP 117, inf if nothing was hit up to `range_max`, -inf if a hit is closer than
    `range_min`, and nan if a beam gave no valid measurement. Beam k points at `angle_min + k * angle_increment` in the
    lidar frame, which is at `mount` in the base frame of the robot. For a lidar that is not level, `tilted_mount` is
    its full pose and `mount` its projection on the plane; see `level_readings.level_scan`.
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
        """Return the hits (m, 2) in the base frame of the robot, without beams that hit nothing."""
        hit = np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges <= self.range_max)
        angles, ranges = self.angles()[hit], self.ranges[hit]
        flat = np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles)))
        if self.tilted_mount is not None:
            return self.tilted_mount.apply(np.column_stack((flat, np.zeros(len(flat)))))[:, :2]
        return self.mount.apply(flat)


@fast_dataclass()
class Odometry:
    """Dead reckoning: `pose` in the odom frame, `twist` in the base frame.

    `twist_variance` contains the variances of the errors of vx, vy and wz, which are independent. `pose_covariance` is
    that of the accumulated error in the odom frame. As in ROS, zeros in all places mean that it is unknown.
    """

    sensor: str
    tick: int
    pose: Pose2
    twist: Twist
    twist_variance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pose_covariance: PoseCovariance = UNKNOWN_POSE_COVARIANCE


@fast_dataclass()
class Imu:
    """Angular velocity (rad/s) and specific force (m/s², including gravity) about x, y, z of the sensor frame.

    The sensor frame is at `mount` in the base frame; by default both are the same. The variances are those of the
    white noise of each axis; a constant bias comes on top. 0 = unknown, as in ROS.
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
    """State of a bumper."""

    sensor: str
    tick: int
    pressed: bool


@dataclass(frozen=True, eq=False)
class Image:
    """Camera frame: `rgb` (h, w, 3) uint8, `depth` (h, w) in m along the optical axis, inf if nothing was hit.

    The camera is at `mount` in the base frame of the robot and looks along the x axis. `field_of_view` is the
    horizontal angle in rad for square pixels; 0 if unknown.
    """

    sensor: str
    tick: int
    rgb: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    mount: Pose3 = Pose3()
    field_of_view: float = 0.0


Reading = Scan | Odometry | Imu | Bump | Image
Readings = tuple[Reading, ...]
