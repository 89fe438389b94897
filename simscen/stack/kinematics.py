"""Kinematics of a base: poses on arcs at constant velocity, cusps of paths, and velocity limits."""

import cmath
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.stack.protocols import RobotModel

MIN_YAW_RATE_RAD_S = 1e-6
"""Yaw rate below which an arc is treated as a straight line."""
STANDSTILL_SPEED_M_S, STANDSTILL_YAW_RATE_RAD_S = 0.02, 0.1
"""The robot counts as standing still below these speeds."""
LOCAL_PLAN_TIMES_S = tuple(0.25 * step for step in range(7))
"""Times at which a controller's arc is sampled for the local plan in the log."""


def is_standstill(twist: Twist) -> bool:
    """Return whether the robot counts as standing still at this velocity."""
    vx, vy, wz = twist
    return abs(vx) + abs(vy) < STANDSTILL_SPEED_M_S and abs(wz) < STANDSTILL_YAW_RATE_RAD_S


def poses_along(pose: Pose2, twist: Twist, times: Array) -> Array:
    """Return the poses (n, 3) of a base that starts at `pose` with constant `twist`, after `times` (n,) in s."""
    vx, vy, wz = twist
    turned = wz * times
    if abs(wz) < MIN_YAW_RATE_RAD_S:
        x, y = vx * times, vy * times
    else:
        forward, left = np.sin(turned) / wz, (1.0 - np.cos(turned)) / wz
        x, y = (vx * forward, vx * left) if vy == 0.0 else (vx * forward - vy * left, vx * left + vy * forward)
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    poses = np.empty((len(times), 3))
    poses[:, 0], poses[:, 1], poses[:, 2] = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y, turned
    poses[:, 2] += pose.yaw
    return poses


def arc_poses(pose: Pose2, twist: Twist, times: Iterable[float]) -> Array:
    """Return the same poses (n, 3) as `poses_along`, but with wrapped headings. Faster for up to a dozen times."""
    (x, y, yaw), (vx, vy, wz) = pose, twist
    start, velocity = complex(x, y), cmath.rect(1.0, yaw) * complex(vx, vy)
    poses: list[tuple[float, float, float]] = []
    for time in times:
        turned = wz * time
        effective_time = time if abs(wz) < MIN_YAW_RATE_RAD_S else (cmath.rect(1.0, turned) - 1.0) / complex(0.0, wz)
        position = start + velocity * effective_time
        poses.append((position.real, position.imag, wrap(yaw + turned)))
    return np.array(poses)


def mean_velocity(step: Pose2, seconds: float) -> Twist:
    """Return the constant velocity that moves a base by `step` within `seconds`. `step` is in the base frame.

    The length of the arc is approximated by the length of the chord.
    """
    x, y, turn = step
    c, s = math.cos(turn / 2), math.sin(turn / 2)  # the chord of the arc is at half the turn
    return Twist((c * x + s * y) / seconds, (c * y - s * x) / seconds, turn / seconds)


def forward_steps(poses: Array) -> npt.NDArray[np.bool_]:
    """Return for each step (n - 1,) between poses (n, 3) whether the robot drives forward."""
    steps = np.diff(poses[:, :2], axis=0)
    forward: npt.NDArray[np.bool_] = steps[:, 0] * np.cos(poses[:-1, 2]) + steps[:, 1] * np.sin(poses[:-1, 2]) >= -1e-9
    return forward


def direction_changes(forward: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Return the indices of the poses between a forward and a backward step. `forward` comes from `forward_steps`."""
    return np.flatnonzero(forward[1:] != forward[:-1]) + 1


def cusps(poses: Array) -> npt.NDArray[np.int64]:
    """Return the indices of the cusps of a path (n, 3): poses at which the driving direction changes."""
    return direction_changes(forward_steps(poses))


Axes = tuple[float, float, float]
"""Values for vx, vy, and turn rate, in this order."""
OptionalAxes = tuple[float | None, float | None, float | None]
"""Like Axes; None stands for the limit of the robot."""
Limits = TypeVar("Limits", bound="VelocityLimits")
Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True)
class VelocityLimits:
    """Limits for vx, vy, and the turn rate, in SI units and rad.

    low, high:       minimum and maximum velocity
    acceleration:    maximum acceleration
    deceleration:    deceleration limit, negative
    turning_radius:  minimum turning radius in m; 0 for a base that turns in place
    """

    low: Axes
    high: Axes
    acceleration: Axes
    deceleration: Axes
    turning_radius: float

    def scaled(self: Limits, ratio: float) -> Limits:
        """Return limits with the velocities multiplied by `ratio`; the same object if `ratio` is at least 1."""
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
    """Return the requested limits, bounded by the limits of the robot. None stands for the limit of the robot."""
    linear, lateral, angular = robot.max_linear, robot.max_lateral, robot.max_angular
    increase, decrease = robot.linear_acceleration, -robot.linear_deceleration
    angular_change = robot.angular_acceleration
    return VelocityLimits(
        low=_apply_bound(max, low, (-robot.max_reverse, -lateral, -angular)),
        high=_apply_bound(min, high, (linear, lateral, angular)),
        acceleration=_apply_bound(min, acceleration, (increase, increase, angular_change)),
        deceleration=_apply_bound(max, deceleration, (decrease, decrease, -angular_change)),
        turning_radius=max(turning_radius or 0.0, robot.turning_radius),
    )


def _apply_bound(bound: Callable[[float, float], float], requested: OptionalAxes, limits: Axes) -> Axes:
    """Return `bound(value, limit)` for each requested value; `limit` for None. `bound` is min or max."""
    x, y, turn = (
        limit if value is None else bound(value, limit) for value, limit in zip(requested, limits, strict=True)
    )
    return x, y, turn


def accumulate_rows(rows: npt.NDArray[Real]) -> npt.NDArray[Real]:
    """Replace the rows (m, n) by cumulative sums over the rows, in place, and return them. Faster than np.cumsum."""
    for previous, row in pairwise(rows):
        np.add(previous, row, out=row)
    return rows
