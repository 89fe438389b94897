"""Trajectory generator of DWB: sampled velocities and the trajectories to which they lead.

Corresponds to the kinematic parameters, XYThetaIterator and StandardTrajectoryGenerator of dwb_plugins.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.cumulative_sum import accumulate_rows
from simscen.stack.controllers.velocity_limits import VelocityLimits, velocity_limits
from simscen.stack.protocols import RobotModel

SAME_VELOCITY_M_S = 1e-5
"""Nav2's EPSILON: ends of a window no further apart than this are one velocity."""
SQUARED_SPEED_TOLERANCE = float(np.finfo(np.float32).eps)
"""Rounding error allowed for squared speeds."""


@dataclass(frozen=True)
class Kinematics(VelocityLimits):
    """Limits, and what bounds combinations: least and greatest speed in m/s whichever way, least turn rate in rad/s."""

    min_speed_xy: float
    max_speed_xy: float
    min_speed_theta: float

    def scaled(self, share: float) -> "Kinematics":
        """Under a speed limit; Nav2 does not slow reversing, this does."""
        return replace(super().scaled(share), max_speed_xy=self.max_speed_xy * min(share, 1.0))

    def valid(self, velocities: Array) -> Array:
        """Those of the velocities (n, 3) that the base may drive; standing still is none of them."""
        square = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        turn = np.abs(velocities[:, 2])
        slow = (square + SQUARED_SPEED_TOLERANCE < self.min_speed_xy**2) & (
            turn + SQUARED_SPEED_TOLERANCE < self.min_speed_theta
        )
        still = (square == 0.0) & (turn == 0.0)
        fine = (square <= self.max_speed_xy**2 + SQUARED_SPEED_TOLERANCE) & ~slow & ~still
        if self.turning_radius > 0.0:
            fine &= np.abs(velocities[:, 0]) >= turn * self.turning_radius
        return np.asarray(velocities[fine])


def kinematics_of(spec: DwbSpec, robot: RobotModel, fastest: float) -> Kinematics:
    """Return the limits of the specification, bounded by those of the robot."""
    left = fastest if spec.max_vel_y is None else spec.max_vel_y
    limits = velocity_limits(
        robot,
        low=(spec.min_vel_x, -left if spec.min_vel_y is None else spec.min_vel_y, -spec.max_vel_theta),
        high=(fastest, left, spec.max_vel_theta),
        acceleration=(spec.acc_lim_x, spec.acc_lim_y, spec.acc_lim_theta),
        deceleration=(spec.decel_lim_x, spec.decel_lim_y, spec.decel_lim_theta),
    )
    return Kinematics(
        **vars(limits),
        min_speed_xy=spec.min_speed_xy,
        max_speed_xy=fastest if spec.max_speed_xy is None else spec.max_speed_xy,
        min_speed_theta=spec.min_speed_theta,
    )


def project_velocity(now: float, acceleration: float, deceleration: float, seconds: float, target: float) -> float:
    """Return the velocity after so many seconds on the way to the target (dwb_plugins' projectVelocity)."""
    if now < target:
        return min(target, now + acceleration * seconds)
    return max(target, now + deceleration * seconds)


def velocity_samples(
    now: float, low: float, high: float, acceleration: float, deceleration: float, seconds: float, count: int
) -> list[float]:
    """`count` velocities between those that can be reached within so many seconds, and 0 if it lies between two."""
    now = min(max(now, low), high)
    most = project_velocity(now, acceleration, deceleration, seconds, high)
    least = project_velocity(now, acceleration, deceleration, seconds, low)
    if abs(most - least) < SAME_VELOCITY_M_S:
        return [least]
    step = (most - least) / (max(2, count) - 1)
    found = []
    velocity = least
    while velocity <= most + SAME_VELOCITY_M_S:
        found.append(velocity)
        if velocity < 0.0 < velocity + step <= most + SAME_VELOCITY_M_S:
            found.append(0.0)
        velocity += step
    return found


def velocity_window(kinematics: Kinematics, now: Twist, seconds: float, counts: tuple[int, int, int]) -> Array:
    """Velocities (n, 3) of vx, vy and turn rate that can be reached within so many seconds; vx changes slowest."""
    k = kinematics
    axes = [
        velocity_samples(velocity, low, high, up, down, seconds, count)
        for velocity, low, high, up, down, count in zip(
            now, k.low, k.high, k.acceleration, k.deceleration, counts, strict=True
        )
    ]
    return k.valid(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Positions (steps, n) of trajectories that begin where the robot is, and headings (steps, m) of the few turns.

    `turn` (n,) says which of the headings are each trajectory's: most share theirs with others, and sines are dear.
    `passed` (steps, m) are the seconds till then.
    """

    x: Array
    y: Array
    yaw: Array
    turn: npt.NDArray[np.intp]
    passed: Array

    def __len__(self) -> int:
        return len(self.turn)

    @property
    def ends(self) -> Array:
        """The last poses (n, 3)."""
        return np.column_stack((self.x[-1], self.y[-1], self.yaw[-1, self.turn]))

    def poses(self, which: npt.NDArray[np.intp]) -> Array:
        """All poses (steps, k, 3) of k of them."""
        return np.stack((self.x[:, which], self.y[:, which], self.yaw[:, self.turn[which]]), axis=-1)


def generate_trajectories(
    pose: Pose2, now: Twist, velocities: Array, kinematics: Kinematics, seconds: float, meters: float, radians: float
) -> Trajectories:
    """Return the trajectories of a base that changes to each of the velocities (n, 3).

    A trajectory has as many steps as it takes for none to be longer than `meters` or to turn by more than `radians`
    at its velocity; those with fewer than others stay at their end. Each step keeps the heading it begins with.
    """
    linear = np.hypot(velocities[:, 0], velocities[:, 1]) * seconds / meters
    counts = np.maximum(1.0, np.ceil(np.maximum(linear, np.abs(velocities[:, 2]) * seconds / radians)))
    _, one, turn = np.unique(velocities[:, 2] + 1j * counts, return_index=True, return_inverse=True)
    count, dt = counts[one], seconds / counts[one]
    number = np.arange(math.ceil(counts.max()) + 1)[:, None]
    moments, number = np.minimum(number, count) * dt, number[1:]
    after, lasts = moments[1:], np.where(number <= count, dt, 0.0)
    bounds = list(zip(now, kinematics.acceleration, kinematics.deceleration, strict=True))
    wz = _changing(velocities[one, 2], *bounds[2], after)
    yaw = _from(pose.yaw, wz * lasts)
    cosine, sine = (each.take(turn, axis=1) for each in (np.cos(yaw[:-1]) * lasts, np.sin(yaw[:-1]) * lasts))
    passed = after.take(turn, axis=1)
    vx = _changing(velocities[:, 0], *bounds[0], passed)
    dx, dy = vx * cosine, vx * sine
    if now.vy != 0.0 or velocities[:, 1].any():
        vy = _changing(velocities[:, 1], *bounds[1], passed)
        dx, dy = dx - vy * sine, dy + vy * cosine
    return Trajectories(_from(pose.x, dx), _from(pose.y, dy), yaw, turn, moments)


def _changing(target: Array, start: float, up: float, down: float, passed: Array) -> Array:
    """Return the velocities (steps, n) on the way from `start` to the targets (n,) at the given times in s."""
    velocities = passed * np.where(start < target, up, down)
    velocities += start
    np.maximum(velocities, np.minimum(start, target), out=velocities)
    return np.minimum(velocities, np.maximum(start, target), out=velocities)


def _from(start: float, steps: Array) -> Array:
    """Return the positions (m + 1, n) reached from a start by steps (m, n)."""
    places = np.empty((len(steps) + 1, steps.shape[1]))
    places[0], places[1:] = 0.0, steps
    accumulate_rows(places[1:])
    places += start
    return places
