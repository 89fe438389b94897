"""The velocities that DWB tries: dwb_plugins' kinematic parameters and its iterator over vx, vy and turn rate."""

from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array
from simscen.core.motion import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.protocols import RobotModel

SAME = 1e-5
"""Nav2's EPSILON: ends of a window no further apart than this are one velocity."""
ROUNDING = float(np.finfo(np.float32).eps)
"""What squares of speeds may exceed their bounds by."""

Axes = tuple[float, float, float]


@dataclass(frozen=True)
class Kinematics:
    """Bounds of vx, vy in m/s and turn rate in rad/s; what a second changes upward, and downward (negative)."""

    low: Axes
    high: Axes
    acceleration: Axes
    deceleration: Axes
    min_speed_xy: float
    max_speed_xy: float
    min_speed_theta: float
    turning_radius: float

    def scaled(self, share: float) -> "Kinematics":
        """Under a speed limit, all greatest velocities by the same share; Nav2 does not slow reversing, this does."""
        if share >= 1.0:
            return self
        (a, b, c), (d, e, f) = self.low, self.high
        low, high = (a * share, b * share, c * share), (d * share, e * share, f * share)
        return replace(self, low=low, high=high, max_speed_xy=self.max_speed_xy * share)

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
    faster, slower, turn = robot.linear_acceleration, -robot.linear_deceleration, robot.angular_acceleration
    left = min(fastest if spec.max_vel_y is None else spec.max_vel_y, robot.max_lateral)
    right = max(-left if spec.min_vel_y is None else spec.min_vel_y, -robot.max_lateral)
    around = min(spec.max_vel_theta, robot.max_angular)
    ups = ((spec.acc_lim_x, faster), (spec.acc_lim_y, faster), (spec.acc_lim_theta, turn))
    downs = ((spec.decel_lim_x, slower), (spec.decel_lim_y, slower), (spec.decel_lim_theta, -turn))
    ax, ay, az = (min(asked or can, can) for asked, can in ups)
    dx, dy, dz = (max(asked or can, can) for asked, can in downs)
    return Kinematics(
        low=(max(spec.min_vel_x, -robot.max_reverse), right, -around),
        high=(fastest, left, around),
        acceleration=(ax, ay, az),
        deceleration=(dx, dy, dz),
        min_speed_xy=spec.min_speed_xy,
        max_speed_xy=fastest if spec.max_speed_xy is None else spec.max_speed_xy,
        min_speed_theta=spec.min_speed_theta,
        turning_radius=robot.turning_radius,
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
