"""The velocities that DWB tries: dwb_plugins' kinematic parameters and its iterator over vx, vy and turn rate."""

from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.limits import Limits, limits_of
from simscen.stack.protocols import RobotModel

SAME = 1e-5
"""Nav2's EPSILON: ends of a window no further apart than this are one velocity."""
ROUNDING = float(np.finfo(np.float32).eps)
"""What squares of speeds may exceed their bounds by."""


@dataclass(frozen=True)
class Kinematics(Limits):
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
        slow = (square + ROUNDING < self.min_speed_xy**2) & (turn + ROUNDING < self.min_speed_theta)
        still = (square == 0.0) & (turn == 0.0)
        fine = (square <= self.max_speed_xy**2 + ROUNDING) & ~slow & ~still
        if self.turning_radius > 0.0:
            fine &= np.abs(velocities[:, 0]) >= turn * self.turning_radius
        return np.asarray(velocities[fine])


def kinematics_of(spec: DwbSpec, robot: RobotModel, fastest: float) -> Kinematics:
    """What the specification asks for, or leaves to the robot, and no more than that can do."""
    left = fastest if spec.max_vel_y is None else spec.max_vel_y
    limits = limits_of(
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


def projected(now: float, acceleration: float, deceleration: float, seconds: float, target: float) -> float:
    """The velocity after so many seconds on the way to the target (dwb_plugins' projectVelocity)."""
    if now < target:
        return min(target, now + acceleration * seconds)
    return max(target, now + deceleration * seconds)


def samples(
    now: float, low: float, high: float, acceleration: float, deceleration: float, seconds: float, count: int
) -> list[float]:
    """`count` velocities between those that can be reached within so many seconds, and 0 if it lies between two."""
    now = min(max(now, low), high)
    most = projected(now, acceleration, deceleration, seconds, high)
    least = projected(now, acceleration, deceleration, seconds, low)
    if abs(most - least) < SAME:
        return [least]
    step = (most - least) / (max(2, count) - 1)
    found = []
    velocity = least
    while velocity <= most + SAME:
        found.append(velocity)
        if velocity < 0.0 < velocity + step <= most + SAME:
            found.append(0.0)
        velocity += step
    return found


def window(kinematics: Kinematics, now: Twist, seconds: float, counts: tuple[int, int, int]) -> Array:
    """Velocities (n, 3) of vx, vy and turn rate that can be reached within so many seconds; vx changes slowest."""
    k = kinematics
    axes = [
        samples(velocity, low, high, up, down, seconds, count)
        for velocity, low, high, up, down, count in zip(
            now, k.low, k.high, k.acceleration, k.deceleration, counts, strict=True
        )
    ]
    return k.valid(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))
