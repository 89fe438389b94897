"""Extended Kalman filter that fuses wheel odometry and gyroscope in the odom frame (robot_localization's ekf_node).

Source: Moore and Stouch, A Generalized Extended Kalman Filter Implementation for the Robot Operating System (IAS 2014),
with `two_d_mode`.
"""

import math

import numpy as np
from scipy.linalg import lapack

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.model import localizers as model
from simscen.stack.kinematics import mean_velocity
from simscen.stack.localizers.ekf import MAX_YAW_RATE_RAD_S
from simscen.stack.localizers.kalman_filters import KalmanFilter
from simscen.stack.odometry_history import is_plausible

VX, VY, VYAW, BIAS = range(4)
"""Indices of the state: velocity in the base frame (m/s, m/s, rad/s), and bias of the gyroscope (rad/s)."""
MIN_VARIANCE = 1e-9
"""Minimum variance of a measurement in (m/s)² or (rad/s)²; the same as in robot_localization."""
MAX_GYRO_GAP_S = 0.1
"""Maximum time between two gyroscope readings over which the yaw rate is integrated."""

_WHEELS = np.eye(3, 4)
"""Measurement matrix of the wheels."""
_WHEELS_AND_GYRO = np.vstack((_WHEELS, (0.0, 0.0, 1.0, 1.0)))
"""Measurement matrix of wheels and gyroscope."""
_TRANSLATION_AND_GYRO = _WHEELS_AND_GYRO[[VX, VY, 3]]
"""Measurement matrix of wheels and gyroscope without the yaw rate of the wheels."""
_IDENTITIES = {size: np.eye(size) for size in (3, 4)}
"""Identity matrices by size."""


class OdometryFilter:
    """Fuses wheel odometry and the yaw rate of a gyroscope. `fuse` returns the filtered odometry.

    Each update estimates the mean velocity since the previous update. The wheels measure this velocity. The gyroscope
    measures the yaw rate plus a bias. The pose is the integral of the velocity, and therefore does not jump (REP 105).
    """

    def __init__(self, spec: model.OdometryFilter, tick_rate: int) -> None:
        self._tick_rate = tick_rate
        self._min_ticks = tick_rate / spec.frequency
        self._process_noise = np.diag([*spec.process_noise_covariance, spec.gyro_bias_walk**2])
        self._rejection_threshold = spec.odom0_twist_rejection_threshold
        self._gyro = GyroscopeIntegral(tick_rate)
        self._filter = KalmanFilter(dim_x=4, dim_z=4)
        self._filter.inv = _inverse
        self._filter.x = np.zeros(4)
        self._filter.P = np.diag([0.0, 0.0, 0.0, spec.gyro_bias**2])
        self._covariance = np.zeros((7, 7))
        """Joint covariance of the pose and the state."""
        self._pose_covariance, self._cross_covariance = self._covariance[:3, :3], self._covariance[:3, 3:]
        """Views of `_covariance`: covariance of the pose, and covariance between pose and state."""
        self._jacobian = np.eye(3, 7)
        """Jacobian of the pose after a step, with respect to the pose before the step and the state."""
        self._pose = Pose2(0.0, 0.0)
        self._last_fused: Odometry | None = None
        """Wheel odometry of the last update."""
        self._last_tick: int | None = None
        """Tick of the last wheel odometry."""
        self._period = math.inf
        """Shortest time in s between two readings of the wheels so far."""
        self._step_variances = (0.0, 0.0, 0.0)
        """Variances of the motion since the last update in m², m², rad²."""

    def on_imu(self, imu: Imu) -> None:
        """Add a yaw rate, which the next odometry reading uses."""
        self._gyro.add(imu)

    def fuse(self, odometry: Odometry) -> Odometry | None:
        """Return the filtered odometry at the tick of a reading; None if the reading is unusable or no update is due.

        The first reading is returned unchanged.
        """
        last, last_tick = self._last_fused, self._last_tick
        if not is_plausible(odometry.pose) or (last_tick is not None and odometry.tick <= last_tick):
            return None
        self._last_tick = odometry.tick
        if last is None or last_tick is None:
            self._last_fused, self._pose = odometry, odometry.pose
            self._gyro.turned_until(odometry.tick)
            return odometry
        self._add_variances(odometry, (odometry.tick - last_tick) / self._tick_rate)
        if odometry.tick - last.tick < self._min_ticks:
            return None
        self._last_fused = odometry
        seconds = (odometry.tick - last.tick) / self._tick_rate
        wheels = mean_velocity(last.pose.between(odometry.pose), seconds)
        self._measure(wheels, self._gyro.turned_until(odometry.tick), seconds)
        self._step_variances = (0.0, 0.0, 0.0)
        self._move(seconds)
        vx, vy, wz, _ = self._filter.x.tolist()
        variances = self._filter.P.diagonal().tolist()
        covariance = tuple(self._pose_covariance.ravel().tolist())
        return Odometry(
            odometry.sensor, odometry.tick, self._pose, Twist(vx, vy, wz),
            (variances[VX], variances[VY], variances[VYAW]), covariance,
        )  # fmt: skip

    def _add_variances(self, odometry: Odometry, gap: float) -> None:
        """Add the variances of a reading to the variances of the motion since the last update.

        `gap` is the time in s since the previous reading. Readings that were lost in this time are assumed to have the
        same variances, and are included.
        """
        self._period = min(self._period, gap)
        (x, y, yaw), (vx, vy, wz), factor = self._step_variances, odometry.twist_variance, self._period * gap
        self._step_variances = x + vx * factor, y + vy * factor, yaw + wz * factor

    def _measure(self, wheels: Twist, turned: tuple[float, float] | None, seconds: float) -> None:
        """Predict and update the mean velocity during the last `seconds`.

        `turned` is the angle that the gyroscope has measured, with its variance; None without a measurement.
        """
        self._filter.Q = self._process_noise * seconds
        self._filter.predict()
        squared = seconds**2
        variances = [max(variance / squared, MIN_VARIANCE) for variance in self._step_variances]
        if turned is None:
            measurement, matrix = list(wheels), _WHEELS
        else:
            rate, variance = turned[0] / seconds, max(turned[1] / squared, MIN_VARIANCE)
            if self._wheels_slip(wheels.wz - rate, variances[VYAW] + variance):
                measurement, matrix = [wheels.vx, wheels.vy, rate], _TRANSLATION_AND_GYRO
                variances[VYAW] = variance
            else:
                measurement, matrix = [*wheels, rate], _WHEELS_AND_GYRO
                variances.append(variance)
        self._filter.update(np.array(measurement), R=_diagonal_matrix(variances), H=matrix)
        # The update corrects the state, but not the pose. Therefore, only the covariance between both changes.
        cross = self._cross_covariance
        cross -= cross.dot(self._filter.K.dot(matrix).T)

    def _wheels_slip(self, difference: float, variance: float) -> bool:
        """Return whether the wheels slip, given the `difference` of their yaw rate from the gyroscope's in rad/s.

        `variance` is the variance of the difference without slip.
        """
        difference += self._filter.x.item(BIAS)
        limit = self._rejection_threshold**2 * (variance + self._filter.P.item(BIAS, BIAS))
        return bool(difference**2 > limit)

    def _move(self, seconds: float) -> None:
        """Move the pose by the velocity, at the mean heading of the step, and propagate its covariance."""
        vx, vy, wz, _ = self._filter.x.tolist()
        x, y, yaw = self._pose
        heading = yaw + wz * seconds / 2
        c, s = math.cos(heading) * seconds, math.sin(heading) * seconds
        dx, dy, half = c * vx - s * vy, s * vx + c * vy, seconds / 2
        self._pose = Pose2(x + dx, y + dy, wrap(yaw + wz * seconds))
        jacobian, covariance = self._jacobian, self._covariance
        jacobian[:, 2:6] = (-dy, c, -s, -dy * half), (dx, s, c, dx * half), (1.0, 0.0, 0.0, seconds)
        covariance[3:, 3:], covariance[3:, :3] = self._filter.P, self._cross_covariance.T
        moved = jacobian.dot(covariance)
        self._pose_covariance[:] = moved.dot(jacobian.T)
        self._cross_covariance[:] = moved[:, 3:]


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a positive definite 3x3 or 4x4 matrix. Faster than numpy.linalg.inv."""
    inverse: Array = lapack.dgesv(matrix, _IDENTITIES[len(matrix)])[2]
    return inverse


def _diagonal_matrix(values: list[float]) -> Array:
    """Return the diagonal matrix with these values. Faster than numpy.diag."""
    size = len(values)
    flat = np.zeros(size * size)
    flat[:: size + 1] = values
    return flat.reshape(size, size)


class GyroscopeIntegral:
    """Integrates the yaw rate of a gyroscope between any two ticks, with the trapezoidal rule.

    Up to `MAX_GYRO_GAP_S` after the newest reading, the yaw rate is assumed to be constant.
    """

    def __init__(self, tick_rate: int) -> None:
        self._tick_rate, self._max_gap = tick_rate, MAX_GYRO_GAP_S * tick_rate
        self._tick: int | None = None
        """Tick of the newest reading."""
        self._rate, self._angle = 0.0, 0.0
        """Yaw rate and integrated angle at the newest reading."""
        self._variance_per_s: float | None = None
        """Growth of the variance of the angle in rad²/s; None before the second reading, which shows the period."""
        self._last_call: tuple[int, float] | None = None
        """Tick and angle of the last call of `turned_until`; None if readings are missing since this call."""

    def add(self, imu: Imu) -> None:
        """Add the yaw rate of a reading. Ignore a reading that is invalid, or not newer than the last reading."""
        tick, rate = imu.tick, imu.angular_velocity[2]
        if not abs(rate) < MAX_YAW_RATE_RAD_S or (self._tick is not None and tick <= self._tick):
            return
        if self._tick is None or tick - self._tick > self._max_gap:
            self._last_call = None
        else:
            seconds = (tick - self._tick) / self._tick_rate
            self._angle += (self._rate + rate) / 2 * seconds
            self._variance_per_s = imu.angular_velocity_variance * seconds
        self._tick, self._rate = tick, rate

    def turned_until(self, tick: int) -> tuple[float, float] | None:
        """Return the angle in rad turned from the tick of the last call to `tick`, and the variance of the angle.

        Return None if readings are missing in this time.
        """
        last, self._last_call = self._last_call, None
        if self._tick is None or abs(tick - self._tick) > self._max_gap:
            return None
        angle = self._angle + self._rate * (tick - self._tick) / self._tick_rate
        self._last_call = tick, angle
        if last is None or self._variance_per_s is None:
            return None
        return angle - last[1], self._variance_per_s * (tick - last[0]) / self._tick_rate
