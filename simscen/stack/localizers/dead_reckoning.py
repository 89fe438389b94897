"""Dead reckoning from odometry, and propagation of the covariance of a planar pose.

Source: Probabilistic Robotics, section 5.4. The errors of motion steps are independent, so that covariances add up.
"""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import Ekf
from simscen.stack.odometry_history import is_plausible

CovarianceTriangle = tuple[float, float, float, float, float, float]
"""Upper triangle of a covariance of x, y, and heading a, row by row: xx, xy, xa, yy, ya, aa."""


def propagate_covariance(covariance: Array, dx: float, dy: float, noise: CovarianceTriangle) -> Array:
    """Return the covariance (3, 3) of a pose after a motion by (dx, dy) in m in the map frame.

    `noise` is the covariance of the errors that this motion adds.
    """
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    xx_new, xy_new, xa_new, yy_new, ya_new, aa_new = noise
    xa_moved, ya_moved = xa - dy * aa, ya + dx * aa
    xx_new += xx - dy * (xa + xa_moved)
    xy_new += xy + dx * xa - dy * ya_moved
    yy_new += yy + dx * (ya + ya_moved)
    xa_new, ya_new = xa_new + xa_moved, ya_new + ya_moved
    return np.array(((xx_new, xy_new, xa_new), (xy_new, yy_new, ya_new), (xa_new, ya_new, aa_new + aa)))


def rotation_matrix(yaw: float) -> Array:
    """Return the matrix (3, 3) that rotates pose errors from a frame with heading `yaw` to its parent frame."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def rotate_covariance(covariance: Array, yaw: float) -> CovarianceTriangle:
    """Rotate a covariance (3, 3) from a frame with heading `yaw` to its parent frame. Return the upper triangle."""
    c, s = math.cos(yaw), math.sin(yaw)
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    return (
        c * c * xx - 2 * c * s * xy + s * s * yy, c * s * (xx - yy) + (c * c - s * s) * xy, c * xa - s * ya,
        s * s * xx + 2 * c * s * xy + c * c * yy, s * xa + c * ya, aa,
    )  # fmt: skip


def grow_covariance(
    covariance: Array, yaw: float, step: Pose2, translation_noise: float, rotation_noise: float
) -> Array:
    """Return the covariance (3, 3) of a pose with heading `yaw` after the motion `step` in the base frame.

    `translation_noise` is the standard deviation in m, along the path, after one meter. `rotation_noise` is the
    standard deviation of the heading in rad after one meter or one rad.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy, length = c * step.x - s * step.y, s * step.x + c * step.y, math.hypot(step.x, step.y)
    along = translation_noise**2 / length if length > 0 else 0.0
    heading = rotation_noise**2 * (length + abs(step.yaw))
    noise = along * dx**2, along * dx * dy, 0.0, along * dy**2, 0.0, heading
    return propagate_covariance(covariance, dx, dy, noise)


_UNKNOWN_STD = (100.0, 100.0, np.pi / np.sqrt(3))
"""Standard deviations of x and y in m and of yaw in rad of an unknown pose. The yaw is uniformly distributed."""
_EKF_DEFAULTS = Ekf(type="ekf")
"""Specification of the EKF, whose default noise parameters dead reckoning uses."""


def initial_pose(estimate: Estimate) -> tuple[Pose2, Array]:
    """Return the initial pose and its covariance (3, 3). An unknown pose is the origin with large variances."""
    if estimate.pose is None:
        return Pose2(0.0, 0.0, 0.0), np.diag(np.square(_UNKNOWN_STD))
    return estimate.pose, np.diag(np.square(estimate.std))


class DeadReckoning:
    """Localizer that adds odometry to the initial estimate. The covariance grows with the EKF's default noise."""

    def __init__(self, estimate: Estimate) -> None:
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate."""
        pose, covariance = initial_pose(estimate)
        self._belief = Belief(pose, covariance, pose)
        self._odometry: Pose2 | None = None

    def on_odometry(self, odometry: Odometry) -> None:
        """Move the pose by the odometry since the last reading."""
        if not is_plausible(odometry.pose):
            return
        last, self._odometry = self._odometry, odometry.pose
        belief, step = self._belief, (last or odometry.pose).between(odometry.pose)
        covariance = grow_covariance(
            belief.covariance, belief.pose.yaw, step, _EKF_DEFAULTS.translation_noise, _EKF_DEFAULTS.rotation_noise
        )
        pose = belief.pose.compose(step)
        map_from_odom = pose.compose(odometry.pose.inverse()) if last is None else belief.map_from_odom
        self._belief = Belief(pose, covariance, map_from_odom, updated=odometry.tick)

    def on_scan(self, scan: Scan) -> None:
        """Ignore the reading."""

    def on_imu(self, imu: Imu) -> None:
        """Ignore the reading."""

    @property
    def belief(self) -> Belief:
        """The current pose and its covariance."""
        return self._belief
