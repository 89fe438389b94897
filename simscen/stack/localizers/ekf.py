"""Odometry and a gyroscope in an extended Kalman filter: dead reckoning that notices its wheels slip in a turn.

Probabilistic Robotics, section 3.3, with filterpy's ExtendedKalmanFilter (Labbe). As robot_localization does, the
turn rate is a state that both sensors measure; the gyroscope's bias is one too, and shows while the robot stands.
"""

import math

import numpy as np

from simscen.core.belief import Belief, Estimate
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.sensing import Imu, Odometry, Scan
from simscen.model.stack import Ekf
from simscen.stack.localizers.dead_reckoning import start_of
from simscen.stack.localizers.odometry_track import believable

X, Y, YAW, RATE, BIAS = range(5)
# No robot turns faster than this, in rad/s: a gyroscope that says so is broken.
_FASTEST = 100.0
# Wheels that stand still and a perfect gyroscope would make the innovation's variance zero.
_LEAST_VARIANCE = 1e-12


class EkfLocalizer:
    """Adds up odometry's translations along a heading that odometry and gyroscope agree on. No map: it drifts."""

    def __init__(self, spec: Ekf, estimate: Estimate, tick_rate: int) -> None:
        self._spec, self._tick_rate = spec, tick_rate
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate, with a bias of which nothing more is known than gyro_noise."""
        from filterpy.kalman import ExtendedKalmanFilter

        pose, covariance = start_of(estimate)
        self._filter = ExtendedKalmanFilter(dim_x=5, dim_z=1)
        self._filter.x = np.array([*pose, 0.0, 0.0])
        self._filter.P = np.zeros((5, 5))
        self._filter.P[:RATE, :RATE] = covariance
        self._filter.P[BIAS, BIAS] = self._spec.gyro_noise**2
        self._last: Odometry | None = None
        self._rates: list[float] = []
        self._map_from_odom = pose

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step along the heading that both sensors agree on."""
        last = self._last
        if not believable(odometry.pose) or (last is not None and odometry.tick <= last.tick):
            return
        self._last = odometry
        if last is not None:
            step, seconds = last.pose.between(odometry.pose), (odometry.tick - last.tick) / self._tick_rate
            self._measure_rate(step, seconds)
            self._move(step, seconds)
        self._rates.clear()
        self._map_from_odom = self._pose.compose(odometry.pose.inverse())

    def on_scan(self, scan: Scan) -> None:
        """Nothing."""

    def on_imu(self, imu: Imu) -> None:
        """Keep the turn rate until the next odometry."""
        rate = imu.angular_velocity[2]
        if abs(rate) < _FASTEST:
            self._rates.append(rate)

    @property
    def belief(self) -> Belief:
        """The state at the newest odometry."""
        covariance: Array = self._filter.P[:RATE, :RATE].copy()
        tick = self._last.tick if self._last is not None else 0
        return Belief(self._pose, (covariance + covariance.T) / 2, self._map_from_odom, updated=tick)

    @property
    def _pose(self) -> Pose2:
        x, y, yaw = self._filter.x[:RATE].tolist()
        return Pose2(x, y, wrap(yaw))

    def _measure_rate(self, step: Pose2, seconds: float) -> None:
        """The turn rate of this step, out of odometry's turn and the mean of the gyroscope's readings."""
        state, covariance = self._filter.x, self._filter.P
        # Nothing is known of the new turn rate, so that the first measurement of it is taken as it is.
        turned = math.hypot(step.x, step.y) + abs(step.yaw)
        state[RATE], covariance[RATE, :], covariance[:, RATE] = step.yaw / seconds, 0.0, 0.0
        covariance[RATE, RATE] = self._spec.rotation_noise**2 * turned / seconds**2
        if self._rates:
            mean, row = sum(self._rates) / len(self._rates), np.array([[0.0, 0, 0, 1, 1]])
            noise = np.array([[self._spec.gyro_noise**2 / len(self._rates) + _LEAST_VARIANCE]])
            self._filter.update(np.array([mean]), lambda _: row, lambda state: row @ state, R=noise)

    def _move(self, step: Pose2, seconds: float) -> None:
        """Drive the step; a turn other than odometry's turns its chord by half the difference."""
        x, y, yaw, rate, bias = self._filter.x.tolist()
        along = yaw + (rate * seconds - step.yaw) / 2
        c, s = math.cos(along), math.sin(along)
        dx, dy, length = c * step.x - s * step.y, s * step.x + c * step.y, math.hypot(step.x, step.y)
        self._filter.F = np.eye(5)
        self._filter.F[:2, YAW] = -dy, dx
        self._filter.F[:3, RATE] = -dy * seconds / 2, dx * seconds / 2, seconds
        self._filter.Q = np.zeros((5, 5))
        if length > 0:
            self._filter.Q[:2, :2] = self._spec.translation_noise**2 / length * np.outer((dx, dy), (dx, dy))
        self._filter.predict()
        self._filter.x = np.array([x + dx, y + dy, wrap(yaw + rate * seconds), rate, bias])
