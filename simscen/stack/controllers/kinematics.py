"""Velocity limits of a base, and cumulative sums that integrate velocities; shared by DWB and MPPI."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.stack.protocols import RobotModel

Axes = tuple[float, float, float]
"""Values for vx, vy, and turn rate."""
OptionalAxes = tuple[float | None, float | None, float | None]
Limits = TypeVar("Limits", bound="VelocityLimits")
Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True)
class VelocityLimits:
    """Limits of vx and vy in m/s and of the turn rate in rad/s, and their acceleration and (negative) deceleration.

    `turning_radius` is the minimum turning radius in m; 0 for a base that turns in place.
    """

    low: Axes
    high: Axes
    acceleration: Axes
    deceleration: Axes
    turning_radius: float

    def scaled(self: Limits, ratio: float) -> Limits:
        """Return the limits with all velocities scaled by a speed limit; the same object if `ratio` is at least 1."""
        if ratio >= 1.0:
            return self
        (a, b, c), (d, e, f) = self.low, self.high
        return replace(self, low=(a * ratio, b * ratio, c * ratio), high=(d * ratio, e * ratio, f * ratio))


def velocity_limits(
    robot: RobotModel,
    low: Axes,
    high: Axes,
    acceleration: OptionalAxes,
    deceleration: OptionalAxes,
    turning_radius: float | None = None,
) -> VelocityLimits:
    """Return the requested limits, bounded by those of the robot; None means the limit of the robot."""
    linear, lateral, angular = robot.max_linear, robot.max_lateral, robot.max_angular
    increase, decrease = robot.linear_acceleration, -robot.linear_deceleration
    angular_change = robot.angular_acceleration
    return VelocityLimits(
        low=_bounded(max, low, (-robot.max_reverse, -lateral, -angular)),
        high=_bounded(min, high, (linear, lateral, angular)),
        acceleration=_bounded(min, acceleration, (increase, increase, angular_change)),
        deceleration=_bounded(max, deceleration, (decrease, decrease, -angular_change)),
        turning_radius=max(turning_radius or 0.0, robot.turning_radius),
    )


def _bounded(bound: Callable[[float, float], float], requested: OptionalAxes, limits: Axes) -> Axes:
    x, y, turn = (
        limit if value is None else bound(value, limit) for value, limit in zip(requested, limits, strict=True)
    )
    return x, y, turn


def accumulate_rows(rows: npt.NDArray[Real]) -> npt.NDArray[Real]:
    """Replace the rows (m, n) by their cumulative sums, in place, several times as fast as np.cumsum."""
    for previous, row in pairwise(rows):
        np.add(previous, row, out=row)
    return rows
