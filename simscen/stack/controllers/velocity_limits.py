"""Limits of velocity and acceleration: the values of a specification, bounded by those of the robot."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

from simscen.stack.protocols import RobotModel

Axes = tuple[float, float, float]
Own = TypeVar("Own", bound="VelocityLimits")
Asked = tuple[float | None, float | None, float | None]


@dataclass(frozen=True)
class VelocityLimits:
    """Bounds of vx, vy in m/s and turn rate in rad/s; what a second changes upward, and downward (negative).

    `turning_radius` is the least in meters, 0 for a base that turns in place.
    """

    low: Axes
    high: Axes
    acceleration: Axes
    deceleration: Axes
    turning_radius: float

    def scaled(self: Own, share: float) -> Own:
        """Return the limits with all velocities scaled by a speed limit."""
        if share >= 1.0:
            return self
        (a, b, c), (d, e, f) = self.low, self.high
        return replace(self, low=(a * share, b * share, c * share), high=(d * share, e * share, f * share))


def velocity_limits(
    robot: RobotModel,
    low: Axes,
    high: Axes,
    acceleration: Asked,
    deceleration: Asked,
    turning_radius: float | None = None,
) -> VelocityLimits:
    """Return the requested limits, bounded by those of the robot; None means the limit of the robot."""
    forward, sideways, turn = robot.max_linear, robot.max_lateral, robot.max_angular
    faster, slower = robot.linear_acceleration, -robot.linear_deceleration
    round_ = robot.angular_acceleration
    return VelocityLimits(
        low=_each(max, low, (-robot.max_reverse, -sideways, -turn)),
        high=_each(min, high, (forward, sideways, turn)),
        acceleration=_each(min, acceleration, (faster, faster, round_)),
        deceleration=_each(max, deceleration, (slower, slower, -round_)),
        turning_radius=max(turning_radius or 0.0, robot.turning_radius),
    )


def _each(bounded: Callable[[float, float], float], asked: Asked, can: Axes) -> Axes:
    x, y, turn = (most if one is None else bounded(one, most) for one, most in zip(asked, can, strict=True))
    return x, y, turn
