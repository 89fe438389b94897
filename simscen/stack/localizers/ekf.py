"""Extended Kalman filter (EKF) that fuses wheel odometry and a gyroscope, as robot_localization's ekf_node does.

Sources: Probabilistic Robotics, section 3.3; filterpy's ExtendedKalmanFilter (Labbe).
"""

import math
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import EkfParameters
from simscen.stack.kinematics import mean_velocity
from simscen.stack.localizers.dead_reckoning import initial_pose
from simscen.stack.odometry_history import is_plausible

X, Y, YAW, VX, VY, VYAW, BIAS = range(7)
"""Indices of the state: the pose in the map frame, the velocity in the base frame, and the bias of the gyroscope."""
VELOCITY_VARIANCE = 1e6
"""Process noise of the velocity in (m/s)² and (rad/s)². The large value removes the effect of earlier velocities."""
MIN_YAW_RATE_STD_RAD_S = 0.002
"""Standard deviation of the yaw rate that is measured by wheels at rest."""
MAX_YAW_RATE_RAD_S = 100.0
"""Absolute yaw rate above which gyroscope readings are ignored as invalid."""

_WHEELS_MATRIX = np.zeros((3, 7))
"""Measurement matrix of wheel odometry."""
_WHEELS_MATRIX[[0, 1, 2], [VX, VY, VYAW]] = 1.0
_GYROSCOPE_MATRIX = np.zeros((1, 7))
"""Measurement matrix of a gyroscope."""
_GYROSCOPE_MATRIX[0, [VYAW, BIAS]] = 1.0


class EkfLocalizer:
    """Localizer with a planar EKF of odometry and gyroscope. The error grows with time, because no map is used.

    Each odometry reading measures the mean velocity since the previous reading, with noise that grows with the distance
    driven. The gyroscope measures the yaw rate plus a bias, which the filter estimates.

    Subclasses may override `_advance`, and use another state of seven values. The first three values are the pose.
    """

    _bias_index: ClassVar[int] = BIAS
    """Index of the gyroscope's bias in the state."""

    def __init__(self, spec: EkfParameters, estimate: Estimate, tick_rate: int) -> None:
        self._spec, self._tick_rate = spec, tick_rate
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate."""
        from simscen.stack.localizers.kalman_filters import ExtendedKalmanFilter

        pose, covariance = initial_pose(estimate)
        bias = self._spec.gyro_noise if self._spec.gyro_bias is None else self._spec.gyro_bias
        self._filter = ExtendedKalmanFilter(dim_x=7, dim_z=1)
        self._filter.predict_x = self._set_state
        self._filter.x = np.array([*pose, 0.0, 0.0, 0.0, 0.0])
        self._filter.P = np.zeros((7, 7))
        self._filter.P[:3, :3], self._filter.P[self._bias_index, self._bias_index] = covariance, bias**2
        self._last: Odometry | None = None
        self._yaw_rates: list[float] = []
        self._map_from_odom = pose

    def on_odometry(self, odometry: Odometry) -> None:
        """Predict the pose at the time of this reading. Ignores implausible and out-of-order readings."""
        last = self._last
        if not is_plausible(odometry.pose) or (last is not None and odometry.tick <= last.tick):
            return
        self._last = odometry
        if last is not None:
            self._advance(last.pose.between(odometry.pose), (odometry.tick - last.tick) / self._tick_rate)
        self._yaw_rates.clear()
        self._map_from_odom = self.pose.compose(odometry.pose.inverse())

    def on_scan(self, scan: Scan) -> None:
        """Ignore scans."""

    def on_imu(self, imu: Imu) -> None:
        """Store the yaw rate for the next odometry reading."""
        rate = imu.angular_velocity[2]
        if abs(rate) < MAX_YAW_RATE_RAD_S:
            self._yaw_rates.append(rate)

    @property
    def belief(self) -> Belief:
        """The pose at the newest odometry reading, with its covariance."""
        covariance: Array = self._filter.P[:3, :3]
        tick = self._last.tick if self._last is not None else 0
        return Belief(self.pose, (covariance + covariance.T) / 2, self._map_from_odom, updated=tick)

    @property
    def pose(self) -> Pose2:
        """The pose of the belief."""
        x, y, yaw = self._filter.x[:3].tolist()
        return Pose2(x, y, wrap(yaw))

    def _advance(self, step: Pose2, seconds: float) -> None:
        """Update the velocity with `step`, the odometry motion of the last `seconds`, and integrate the velocity."""
        self._measure_velocity(step, seconds)
        self._move(seconds)

    def _measure_velocity(self, step: Pose2, seconds: float) -> None:
        """Update the velocity with `step`, the odometry motion of the last `seconds`, and with the gyroscope."""
        transition, noise = np.eye(7), np.zeros((7, 7))
        velocities = [VX, VY, VYAW]
        transition[velocities, velocities], noise[velocities, velocities] = 0.0, VELOCITY_VARIANCE
        noise[BIAS, BIAS] = self._spec.gyro_bias_walk**2 * seconds
        self._predict(transition @ self._filter.x, transition, noise)
        velocity = np.array(mean_velocity(step, seconds))
        self._update(velocity, _WHEELS_MATRIX, self._wheel_noise(step, velocity, seconds))
        if self._yaw_rates:
            mean = sum(self._yaw_rates) / len(self._yaw_rates)
            variance = self._spec.gyro_noise**2 / len(self._yaw_rates)
            self._update(np.array([mean]), _GYROSCOPE_MATRIX, np.array([[variance]]))

    def _wheel_noise(self, step: Pose2, velocity: Array, seconds: float) -> Array:
        """Return the covariance (3, 3) of the velocity measured by the wheels."""
        length = math.hypot(step.x, step.y)
        along = velocity[:2] * seconds
        noise = np.zeros((3, 3))
        if length > 0:
            noise[:2, :2] = self._spec.translation_noise**2 / length * np.outer(along, along)
        noise[2, 2] = self._spec.rotation_noise**2 * (length + abs(step.yaw))
        noise /= seconds**2
        noise[2, 2] += MIN_YAW_RATE_STD_RAD_S**2
        return noise

    def _move(self, seconds: float) -> None:
        """Move the pose by the velocity for `seconds`, at the mean heading of the step."""
        state: Array = self._filter.x.copy()
        heading = float(state[YAW] + state[VYAW] * seconds / 2)
        c, s = math.cos(heading), math.sin(heading)
        dx = (c * state[VX] - s * state[VY]) * seconds
        dy = (s * state[VX] + c * state[VY]) * seconds
        state[X] += dx
        state[Y] += dy
        state[YAW] = math.remainder(state[YAW] + state[VYAW] * seconds, 2 * math.pi)
        jacobian = np.eye(7)
        jacobian[:2, YAW] = -dy, dx
        jacobian[:2, VX], jacobian[:2, VY] = (c * seconds, s * seconds), (-s * seconds, c * seconds)
        jacobian[:3, VYAW] = -dy * seconds / 2, dx * seconds / 2, seconds
        self._predict(state, jacobian, np.zeros((7, 7)))

    def _predict(self, state: Array, jacobian: Array, noise: Array) -> None:
        """Set the predicted `state`, and propagate the covariance with the process `noise` (7, 7)."""
        self._filter.F, self._filter.Q = jacobian, noise
        self._filter.predict(state)

    def _set_state(self, state: Array) -> None:
        """Set the predicted state. Replaces filterpy's `predict_x`, which predicts only linear motion."""
        self._filter.x = state

    def _update(self, measurement: Array, matrix: Array, noise: Array) -> None:
        """Correct the state with a measurement, its measurement matrix, and the covariance of its noise."""
        self._filter.update(measurement, lambda _: matrix, lambda state: matrix @ state, R=noise)
