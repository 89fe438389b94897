"""Trajectory generator of DWB (dwb_plugins' StandardTrajectoryGenerator): samples velocities, and predicts poses."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.kinematics import VelocityLimits, accumulate_rows, velocity_limits
from simscen.stack.protocols import RobotModel

MIN_VELOCITY_RANGE_M_S = 1e-5
"""Minimum width of a velocity range from which more than one velocity is sampled (EPSILON in Nav2)."""
SQUARED_SPEED_TOLERANCE = float(np.finfo(np.float32).eps)
"""Rounding error allowed for squared speeds in m²/s², and for turn rates in rad/s."""


@dataclass(frozen=True)
class KinematicParameters(VelocityLimits):
    """Velocity limits of each axis, limits of the speed in the plane in m/s, and minimum turn rate in rad/s.

    A velocity is too low only if both speed and turn rate are below their minimum.
    """

    min_speed_xy: float
    max_speed_xy: float
    min_speed_theta: float

    def scaled(self, ratio: float) -> "KinematicParameters":
        """Return limits with `low`, `high`, and `max_speed_xy` multiplied by `ratio`, at most by 1."""
        return replace(super().scaled(ratio), max_speed_xy=self.max_speed_xy * min(ratio, 1.0))

    def valid_velocities(self, velocities: Array) -> Array:
        """Return the velocities (m, 3) among `velocities` (n, 3) that are within the limits and not zero."""
        squared_speed = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        turn_rate = np.abs(velocities[:, 2])
        is_slow = (squared_speed + SQUARED_SPEED_TOLERANCE < self.min_speed_xy**2) & (
            turn_rate + SQUARED_SPEED_TOLERANCE < self.min_speed_theta
        )
        is_zero = (squared_speed == 0.0) & (turn_rate == 0.0)
        valid = (squared_speed <= self.max_speed_xy**2 + SQUARED_SPEED_TOLERANCE) & ~is_slow & ~is_zero
        if self.turning_radius > 0.0:
            valid &= np.abs(velocities[:, 0]) >= turn_rate * self.turning_radius
        return np.asarray(velocities[valid])


def kinematic_parameters(spec: DwbSpec, robot: RobotModel, full_speed: float) -> KinematicParameters:
    """Return the limits of the specification, bounded by the robot's limits. `full_speed` is the maximum vx in m/s."""
    lateral = full_speed if spec.max_vel_y is None else spec.max_vel_y
    limits = velocity_limits(
        robot,
        low=(spec.min_vel_x, -lateral if spec.min_vel_y is None else spec.min_vel_y, -spec.max_vel_theta),
        high=(full_speed, lateral, spec.max_vel_theta),
        acceleration=(spec.acc_lim_x, spec.acc_lim_y, spec.acc_lim_theta),
        deceleration=(spec.decel_lim_x, spec.decel_lim_y, spec.decel_lim_theta),
    )
    return KinematicParameters(
        **vars(limits),
        min_speed_xy=spec.min_speed_xy,
        max_speed_xy=full_speed if spec.max_speed_xy is None else spec.max_speed_xy,
        min_speed_theta=spec.min_speed_theta,
    )


def project_velocity(current: float, acceleration: float, deceleration: float, seconds: float, target: float) -> float:
    """Return the velocity after `seconds` of accelerating or decelerating from `current` to `target`.

    `deceleration` is negative.
    """
    if current < target:
        return min(target, current + acceleration * seconds)
    return max(target, current + deceleration * seconds)


def velocity_samples(
    current: float, low: float, high: float, acceleration: float, deceleration: float, seconds: float, count: int
) -> list[float]:
    """Return `count` (at least 2) evenly spaced velocities of one axis that can be reached within `seconds`.

    If 0 lies between two samples, 0 is added.
    """
    current = min(max(current, low), high)
    highest = project_velocity(current, acceleration, deceleration, seconds, high)
    lowest = project_velocity(current, acceleration, deceleration, seconds, low)
    if abs(highest - lowest) < MIN_VELOCITY_RANGE_M_S:
        return [lowest]
    step = (highest - lowest) / (max(2, count) - 1)
    samples = []
    velocity = lowest
    while velocity <= highest + MIN_VELOCITY_RANGE_M_S:
        samples.append(velocity)
        if velocity < 0.0 < velocity + step <= highest + MIN_VELOCITY_RANGE_M_S:
            samples.append(0.0)
        velocity += step
    return samples


def velocity_window(limits: KinematicParameters, current: Twist, seconds: float, counts: tuple[int, int, int]) -> Array:
    """Return valid velocities (n, 3) that can be reached from `current` within `seconds`.

    `counts` are the numbers of samples for vx, vy, and turn rate.
    """
    axes = [
        velocity_samples(velocity, low, high, acceleration, deceleration, seconds, count)
        for velocity, low, high, acceleration, deceleration, count in zip(
            current, limits.low, limits.high, limits.acceleration, limits.deceleration, counts, strict=True
        )
    ]
    return limits.valid_velocities(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Poses of n trajectories. Several trajectories can share the same headings.

    x, y:       positions (steps, n) in m
    yaw:        headings (steps, m) in rad
    yaw_index:  column (n,) of each trajectory in `yaw` and `times`
    times:      times (steps, m) of the poses in s
    """

    x: Array
    y: Array
    yaw: Array
    yaw_index: npt.NDArray[np.intp]
    times: Array

    def __len__(self) -> int:
        return len(self.yaw_index)

    @property
    def ends(self) -> Array:
        """Final poses (n, 3)."""
        return np.column_stack((self.x[-1], self.y[-1], self.yaw[-1, self.yaw_index]))

    def poses(self, indices: npt.NDArray[np.intp]) -> Array:
        """Return the poses (steps, k, 3) of the k trajectories with these indices."""
        return np.stack((self.x[:, indices], self.y[:, indices], self.yaw[:, self.yaw_index[indices]]), axis=-1)


def generate_trajectories(
    pose: Pose2,
    current: Twist,
    velocities: Array,
    limits: KinematicParameters,
    seconds: float,
    max_step_m: float,
    max_step_rad: float,
) -> Trajectories:
    """Return trajectories from `pose`, in which the base accelerates from `current` to each of the velocities (n, 3).

    A trajectory takes `seconds`. Steps are at most `max_step_m` and `max_step_rad` long. The heading is constant within
    a step. Trajectories with fewer steps than others are padded with their final pose.
    """
    distance_steps = np.hypot(velocities[:, 0], velocities[:, 1]) * seconds / max_step_m
    turn_steps = np.abs(velocities[:, 2]) * seconds / max_step_rad
    step_counts = np.maximum(1.0, np.ceil(np.maximum(distance_steps, turn_steps)))
    _, first, yaw_index = np.unique(velocities[:, 2] + 1j * step_counts, return_index=True, return_inverse=True)
    count, dt = step_counts[first], seconds / step_counts[first]
    step = np.arange(math.ceil(step_counts.max()) + 1)[:, None]
    times, step = np.minimum(step, count) * dt, step[1:]
    yaw_times, durations = times[1:], np.where(step <= count, dt, 0.0)
    axes = list(zip(current, limits.acceleration, limits.deceleration, strict=True))
    wz = _ramp(velocities[first, 2], *axes[2], yaw_times)
    yaw = _accumulate(pose.yaw, wz * durations)
    cosine = (np.cos(yaw[:-1]) * durations).take(yaw_index, axis=1)
    sine = (np.sin(yaw[:-1]) * durations).take(yaw_index, axis=1)
    step_times = yaw_times.take(yaw_index, axis=1)
    vx = _ramp(velocities[:, 0], *axes[0], step_times)
    dx, dy = vx * cosine, vx * sine
    if current.vy != 0.0 or velocities[:, 1].any():
        vy = _ramp(velocities[:, 1], *axes[1], step_times)
        dx, dy = dx - vy * sine, dy + vy * cosine
    return Trajectories(_accumulate(pose.x, dx), _accumulate(pose.y, dy), yaw, yaw_index, times)


def _ramp(target: Array, start: float, acceleration: float, deceleration: float, times: Array) -> Array:
    """Return the velocities (steps, n) at `times` (steps, n) in s while they change from `start` to `target` (n,)."""
    velocities = times * np.where(start < target, acceleration, deceleration)
    velocities += start
    np.maximum(velocities, np.minimum(start, target), out=velocities)
    return np.minimum(velocities, np.maximum(start, target), out=velocities)


def _accumulate(start: float, steps: Array) -> Array:
    """Return the cumulative sums (m + 1, n) of steps (m, n), beginning with `start`."""
    values = np.empty((len(steps) + 1, steps.shape[1]))
    values[0], values[1:] = 0.0, steps
    accumulate_rows(values[1:])
    values += start
    return values
