"""Path that a controller follows, and predictions of the robot's trajectory along it."""

import cmath
import math
from bisect import bisect_right
from collections.abc import Callable

import numpy as np

from simscen.advanced.prediction.rollouts import STEP_S, TIMES, Rollouts
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.protocols import RobotModel

RETURN_TIME_S = 0.7
"""Approximate time constant with which a controller returns to its path."""


class FollowedPath:
    """Path that a controller follows, for predicting its trajectory."""

    def __init__(self, path: Array) -> None:
        """Take the points (n, 2 or more) of the path."""
        self._x, self._y = np.ascontiguousarray(path[:, 0]), np.ascontiguousarray(path[:, 1])
        steps = np.hypot(np.diff(self._x), np.diff(self._y))
        self._arc_lengths = np.concatenate(([0.0], np.cumsum(steps)))
        self._lengths: list[float] = self._arc_lengths.tolist()
        """The same arc lengths in m as floats, which are faster one by one than an array."""
        self._points: list[complex] = (self._x + 1j * self._y).tolist()

    def __len__(self) -> int:
        return len(self._x)

    def nearest(self, pose: Pose2) -> int:
        """Return the index of the path's point nearest to a pose."""
        dx, dy = self._x - pose.x, self._y - pose.y
        dx *= dx
        dy *= dy
        dx += dy
        return int(dx.argmin())

    def point_ahead(self, pose: Pose2, distance: float) -> tuple[float, float]:
        """Return the first point (x, y) after the nearest point that is at least `distance` m from a pose.

        Returns the last point of the path if no point is so far away.
        """
        nearest = self.nearest(pose)
        is_beyond = np.hypot(self._x[nearest:] - pose.x, self._y[nearest:] - pose.y) >= distance
        index = nearest + int(is_beyond.argmax()) if is_beyond.any() else -1
        return float(self._x[index]), float(self._y[index])

    def rollouts(
        self,
        pose: Pose2,
        twist: Twist,
        command: Twist,
        fractions: tuple[float, ...],
        robot: RobotModel,
        with_headings: bool,
    ) -> Rollouts:
        """Return the trajectories of a controller that follows the path, at `fractions` of the commanded speed.

        Without `with_headings`, the headings are 0, which saves time.
        """
        nearest, along = self.nearest(pose), self._arc_lengths
        scale = np.array(fractions)[:, None]
        speeds = scale * command.vx
        rate = np.where(np.abs(speeds) >= abs(twist.vx), robot.linear_acceleration, robot.linear_deceleration) * TIMES
        vx = twist.vx + np.minimum(np.maximum(speeds - twist.vx, -rate), rate)
        is_backward = self._is_backward(pose, command, nearest)
        driven = np.cumsum(vx, axis=1) * (-STEP_S if is_backward else STEP_S)
        arc_lengths = np.minimum(np.maximum(driven, 0.0) + along[nearest], along[-1])
        decay = np.exp(np.abs(driven) / -max(RETURN_TIME_S * abs(command.vx), 0.2))
        x = np.interp(arc_lengths, along, self._x) + (pose.x - self._x[nearest]) * decay
        y = np.interp(arc_lengths, along, self._y) + (pose.y - self._y[nearest]) * decay
        yaw = self._headings(arc_lengths, nearest, is_backward) if with_headings else np.zeros_like(x)
        return Rollouts(x, y, yaw, vx, scale * np.array(command))

    def position_over_time(
        self, pose: Pose2, twist: Twist, command: Twist, robot: RobotModel
    ) -> tuple[Callable[[float], complex], float, float]:
        """Return a function from the time in s to the position (x + iy) at the commanded speed.

        Also return the maximum speed in m/s, and an upper bound in m of the deviation from the positions of `rollouts`,
        which are integrated in time steps.
        """
        nearest, speed, target = self.nearest(pose), twist.vx, command.vx
        rate = robot.linear_acceleration if abs(target) >= abs(speed) else robot.linear_deceleration
        ramp_s, rate = abs(target - speed) / rate, math.copysign(rate, target - speed)
        start, end = self._lengths[nearest], self._lengths[-1]
        offset, decay_distance = complex(pose.x, pose.y) - self._points[nearest], max(RETURN_TIME_S * abs(target), 0.2)
        sign = -1.0 if self._is_backward(pose, command, nearest) else 1.0

        def position(seconds: float) -> complex:
            ramped_s = min(seconds, ramp_s)
            driven = sign * ((speed + 0.5 * rate * ramped_s) * ramped_s + target * (seconds - ramped_s))
            return self._point_at(min(max(driven, 0.0) + start, end)) + offset * math.exp(-abs(driven) / decay_distance)

        factor = 1.0 + abs(offset) / decay_distance
        return position, max(abs(speed), abs(target)) * factor, 0.5 * STEP_S * abs(target - speed) * factor

    def _is_backward(self, pose: Pose2, command: Twist, nearest: int) -> bool:
        """Return whether the robot drives backward toward the end of the path, as a car does on a Reeds-Shepp path.

        The heading of the robot is then opposite to the direction of the path at the point with the index `nearest`.
        """
        index = min(nearest, len(self) - 2)
        direction = self._points[index + 1] - self._points[index]
        return command.vx < 0.0 and (direction * cmath.rect(1.0, -pose.yaw)).real < 0.0

    def _point_at(self, length: float) -> complex:
        """Return the point at a length in m along the path."""
        lengths, points = self._lengths, self._points
        after = min(max(bisect_right(lengths, length), 1), len(lengths) - 1)
        before, segment = lengths[after - 1], lengths[after] - lengths[after - 1]
        ratio = (length - before) / segment if segment > 0.0 else 0.0
        return points[after - 1] + ratio * (points[after] - points[after - 1])

    def _headings(self, arc_lengths: Array, nearest: int, is_backward: bool) -> Array:
        """Return the headings (…,) of the robot at arc lengths in m. Path points before `nearest` are ignored."""
        along, x, y = self._arc_lengths, self._x, self._y
        later = np.minimum(arc_lengths + 0.1, along[-1])
        before = np.maximum(later - 0.2, along[nearest])
        yaw: Array = np.arctan2(
            np.interp(later, along, y) - np.interp(before, along, y),
            np.interp(later, along, x) - np.interp(before, along, x),
        )
        return yaw + math.pi if is_backward else yaw
