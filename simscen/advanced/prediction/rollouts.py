"""Candidate trajectories of the robot for the next HORIZON_S: along its path, or with sequences of two velocities."""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.protocols import RobotModel

STEP_S, HORIZON_S = 0.1, 3.0
"""Time step and horizon."""
FIRST_DURATIONS_S = (0.5, 1.2)
"""Durations of the first velocity of a sequence."""
SPEED_RATIOS = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
"""First speeds relative to full speed."""
TURN_RATIOS = (0.0, 0.1, 0.3, 0.6, 1.0)
"""First turn rates relative to the maximum, in both directions."""
SECOND_SPEED_RATIOS = (0.0, 0.5, 1.0)
"""Second speeds relative to full speed. The second turn rate is 0 or the opposite of the first one."""
MAX_TURN_RATE_RAD_S = 3.0
"""Maximum turn rate of candidates."""
RETURN_TIME_S = 0.7
"""Approximate time constant with which a controller returns to its path."""

TIMES: Array = np.arange(1, round(HORIZON_S / STEP_S) + 1, dtype=np.float64) * STEP_S
"""Times in s of the points of a trajectory."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories: positions, headings, and speeds at TIMES, each (n, times), and first commands (n, 2: vx, wz)."""

    x: Array
    y: Array
    yaw: Array
    vx: Array
    commands: Array


class TrajectorySampler:
    """Sampler of trajectories with all sequences of two velocities, within the acceleration limits of the robot."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot and its full speed in m/s."""
        self._robot = robot
        max_turn = min(robot.max_angular, MAX_TURN_RATE_RAD_S)
        turns = [0.0, *(sign * part * max_turn for part in TURN_RATIOS[1:] for sign in (1.0, -1.0))]
        rows = []
        for part in SPEED_RATIOS:
            first = part * full_speed if part >= 0 else max(part * full_speed, -robot.max_reverse)
            for wz in turns:
                for duration in FIRST_DURATIONS_S:
                    for then in SECOND_SPEED_RATIOS:
                        for back in (0.0, -1.0) if wz else (0.0,):
                            rows.append((first, wz, duration, then * full_speed, back * wz))
        sequences = np.array(sorted(set(rows)))
        if robot.turning_radius > 0.0:
            is_possible = (np.abs(sequences[:, 0]) >= np.abs(sequences[:, 1]) * robot.turning_radius) & (
                np.abs(sequences[:, 3]) >= np.abs(sequences[:, 4]) * robot.turning_radius
            )
            sequences = sequences[is_possible]
        self.commands: Array = sequences[:, :2]
        """First command (n, 2: vx, wz) of each trajectory."""
        self._speeds, self._speed_profile = np.unique(sequences[:, (0, 2, 3)], axis=0, return_inverse=True)
        self._turns, self._turn_profile = np.unique(sequences[:, (1, 2, 4)], axis=0, return_inverse=True)

    def sample(self, pose: Pose2, twist: Twist) -> "TrajectoryFan":
        """Return all trajectories that start at this pose and velocity."""
        robot, speeds, turns = self._robot, self._speeds, self._turns
        first, duration, then = (speeds[:, k : k + 1] for k in range(3))
        vx = _ramp(twist.vx, first, duration, then, robot.linear_acceleration, robot.linear_deceleration)
        first, duration, then = (turns[:, k : k + 1] for k in range(3))
        wz = _ramp(twist.wz, first, duration, then, robot.angular_acceleration, robot.angular_acceleration)
        yaw = pose.yaw + np.cumsum(wz, axis=1) * STEP_S
        middle = yaw - 0.5 * STEP_S * wz
        profiles = self._speed_profile, self._turn_profile
        return TrajectoryFan(pose, vx, yaw, np.cos(middle), np.sin(middle), *profiles, self.commands)


@dataclass(frozen=True, eq=False)
class TrajectoryFan:
    """Trajectories from one pose, as combinations of k speed profiles and m turn profiles.

    vx (k, times):                speeds of the speed profiles
    yaw (m, times):               headings of the turn profiles
    cosine, sine (m, times):      cosine and sine of the headings in the middle of each time step
    speed_profile, turn_profile:  indices (n,) of the profiles of each trajectory
    commands (n, 2):              first command (vx, wz) of each trajectory
    """

    pose: Pose2
    vx: Array
    yaw: Array
    cosine: Array
    sine: Array
    speed_profile: npt.NDArray[np.intp]
    turn_profile: npt.NDArray[np.intp]
    commands: Array

    @property
    def ends(self) -> tuple[Array, Array]:
        """Final x and y (n,) of the trajectories."""
        speed, turn, (x, y, _) = self.speed_profile, self.turn_profile, self.pose
        along, aside = self.vx @ self.cosine.T, self.vx @ self.sine.T
        return x + along[speed, turn] * STEP_S, y + aside[speed, turn] * STEP_S

    def rollouts(self, indices: npt.NDArray[np.intp], steps: int = len(TIMES)) -> Rollouts:
        """Return the trajectories with these indices (k,), for the first `steps` time steps."""
        window, turn = np.s_[:, :steps], self.turn_profile[indices]
        vx = self.vx[window][self.speed_profile[indices]]
        x = self.pose.x + np.cumsum(vx * self.cosine[window][turn], axis=1) * STEP_S
        y = self.pose.y + np.cumsum(vx * self.sine[window][turn], axis=1) * STEP_S
        return Rollouts(x, y, self.yaw[window][turn], vx, self.commands[indices])


def _ramp(now: float, first: Array, duration: Array, then: Array, acceleration: float, deceleration: float) -> Array:
    """Return velocities (n, times) that change from `now` to `first` (n, 1), and after `duration` in s to `then`.

    The rates of change are limited by `acceleration` and `deceleration`.
    """
    up = np.where(np.abs(first) >= abs(now), acceleration, deceleration)
    before = now + np.clip(first - now, -up * np.minimum(TIMES, duration), up * np.minimum(TIMES, duration))
    change = np.where(np.abs(then) >= np.abs(before), acceleration, deceleration) * np.maximum(TIMES - duration, 0.0)
    ramped: Array = before + np.clip(then - before, -change, change)
    return ramped


class FollowedPath:
    """Path that a controller follows, for predicting its trajectory."""

    def __init__(self, path: Array) -> None:
        """Take the points (n, 2 or more) of the path."""
        self._x, self._y = np.ascontiguousarray(path[:, 0]), np.ascontiguousarray(path[:, 1])
        steps = np.hypot(np.diff(self._x), np.diff(self._y))
        self._along = np.concatenate(([0.0], np.cumsum(steps)))
        self._lengths: list[float] = self._along.tolist()
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

    def ahead(self, pose: Pose2, reach: float) -> tuple[float, float]:
        """Return the first point (x, y) at least `reach` m from a pose, starting at the nearest one; else the last."""
        nearest = self.nearest(pose)
        beyond = np.hypot(self._x[nearest:] - pose.x, self._y[nearest:] - pose.y) >= reach
        number = nearest + int(beyond.argmax()) if beyond.any() else -1
        return float(self._x[number]), float(self._y[number])

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
        nearest, along = self.nearest(pose), self._along
        scale = np.array(fractions)[:, None]
        speeds = scale * command.vx
        rate = np.where(np.abs(speeds) >= abs(twist.vx), robot.linear_acceleration, robot.linear_deceleration) * TIMES
        vx = twist.vx + np.minimum(np.maximum(speeds - twist.vx, -rate), rate)
        driven = np.cumsum(vx, axis=1) * STEP_S
        arc_lengths = np.minimum(np.maximum(driven, 0.0) + along[nearest], along[-1])
        decay = np.exp(np.abs(driven) / -max(RETURN_TIME_S * abs(command.vx), 0.2))
        x = np.interp(arc_lengths, along, self._x) + (pose.x - self._x[nearest]) * decay
        y = np.interp(arc_lengths, along, self._y) + (pose.y - self._y[nearest]) * decay
        yaw = self._headings(arc_lengths, nearest, command.vx < 0.0) if with_headings else np.zeros_like(x)
        return Rollouts(x, y, yaw, vx, scale * (command.vx, command.wz))

    def position_over_time(
        self, pose: Pose2, twist: Twist, command: Twist, robot: RobotModel
    ) -> tuple[Callable[[float], complex], float, float]:
        """Return a function from the time in s to the position (x + iy) at the commanded speed.

        Also return the maximum speed in m/s, and an upper bound in m of the deviation from the positions of `rollouts`,
        which are integrated in time steps.
        """
        nearest, now, then = self.nearest(pose), twist.vx, command.vx
        rate = robot.linear_acceleration if abs(then) >= abs(now) else robot.linear_deceleration
        ramp, rate = abs(then - now) / rate, math.copysign(rate, then - now)
        start, end = self._lengths[nearest], self._lengths[-1]
        offset, decay_distance = complex(pose.x, pose.y) - self._points[nearest], max(RETURN_TIME_S * abs(then), 0.2)

        def position(seconds: float) -> complex:
            ramped_for = min(seconds, ramp)
            driven = (now + 0.5 * rate * ramped_for) * ramped_for + then * (seconds - ramped_for)
            return self._point_at(min(max(driven, 0.0) + start, end)) + offset * math.exp(-abs(driven) / decay_distance)

        factor = 1.0 + abs(offset) / decay_distance
        return position, max(abs(now), abs(then)) * factor, 0.5 * STEP_S * abs(then - now) * factor

    def _point_at(self, length: float) -> complex:
        """Return the point at a length in m along the path."""
        lengths, points = self._lengths, self._points
        after = min(max(bisect_right(lengths, length), 1), len(lengths) - 1)
        before, segment = lengths[after - 1], lengths[after] - lengths[after - 1]
        part = (length - before) / segment if segment > 0.0 else 0.0
        return points[after - 1] + part * (points[after] - points[after - 1])

    def _headings(self, arc_lengths: Array, nearest: int, backward: bool) -> Array:
        """Return the headings (…,) of the robot at arc lengths in m. Path points before `nearest` are ignored."""
        along, x, y = self._along, self._x, self._y
        later = np.minimum(arc_lengths + 0.1, along[-1])
        before = np.maximum(later - 0.2, along[nearest])
        yaw: Array = np.arctan2(
            np.interp(later, along, y) - np.interp(before, along, y),
            np.interp(later, along, x) - np.interp(before, along, x),
        )
        return yaw + math.pi if backward else yaw


def arc_rollouts(pose: Pose2, command: Twist, fractions: tuple[float, ...]) -> Rollouts:
    """Return the trajectories of a constant command at `fractions` of its velocity, for a robot without a path."""
    scale = np.array(fractions)[:, None]
    vx, wz = scale * command.vx + 0.0 * TIMES, scale * command.wz + 0.0 * TIMES
    yaw = pose.yaw + wz * TIMES
    middle = yaw - 0.5 * STEP_S * wz
    x = pose.x + np.cumsum(vx * np.cos(middle), axis=1) * STEP_S
    y = pose.y + np.cumsum(vx * np.sin(middle), axis=1) * STEP_S
    return Rollouts(x, y, yaw, vx, np.column_stack((scale * command.vx, scale * command.wz)))
