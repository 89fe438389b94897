"""Candidate trajectories of the robot for the next seconds."""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.protocols import RobotModel

STEP, HORIZON = 0.1, 3.0
"""Time step and horizon in s."""
FIRST = (0.5, 1.2)
"""Durations in s of the first velocity."""
SPEEDS = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
"""First speeds relative to full speed."""
TURNS = (0.0, 0.1, 0.3, 0.6, 1.0)
"""First turn rates relative to the maximum, in both directions."""
THEN = (0.0, 0.5, 1.0)
"""Second speeds relative to full speed, straight or turning back."""
TURN_MOST = 3.0
"""Maximum turn rate in rad/s of candidates."""
BACK_TO_PATH = 0.7
"""Approximate time constant in s with which a controller returns to its path."""

TIMES: Array = np.arange(1, round(HORIZON / STEP) + 1, dtype=np.float64) * STEP


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories (n, times) of the robot: positions and headings at TIMES, speeds, and first commands (n, 2)."""

    x: Array
    y: Array
    yaw: Array
    vx: Array
    commands: Array


class TrajectorySampler:
    """All candidate sequences of two velocities, reached with the accelerations of the robot."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot and its full speed in m/s."""
        self._robot = robot
        turn = min(robot.max_angular, TURN_MOST)
        turns = [0.0, *(sign * part * turn for part in TURNS[1:] for sign in (1.0, -1.0))]
        rows = []
        for part in SPEEDS:
            first = part * full_speed if part >= 0 else max(part * full_speed, -robot.max_reverse)
            for wz in turns:
                for lasts in FIRST:
                    for then in THEN:
                        for back in (0.0, -1.0) if wz else (0.0,):
                            after = then * full_speed if then >= 0 else max(then * full_speed, -robot.max_reverse)
                            rows.append((first, wz, lasts, after, back * wz))
        plan = np.array(sorted(set(rows)))
        if robot.turning_radius > 0.0:
            able = (np.abs(plan[:, 0]) >= np.abs(plan[:, 1]) * robot.turning_radius) & (
                np.abs(plan[:, 3]) >= np.abs(plan[:, 4]) * robot.turning_radius
            )
            plan = plan[able]
        self.commands: Array = plan[:, :2]
        """First command (n, 2) of each trajectory."""
        self._speeds, self._speed = np.unique(plan[:, (0, 2, 3)], axis=0, return_inverse=True)
        self._turns, self._turn = np.unique(plan[:, (1, 2, 4)], axis=0, return_inverse=True)

    def roll(self, pose: Pose2, twist: Twist) -> "TrajectoryFan":
        """Return all trajectories from a pose and velocity."""
        robot, speeds, turns = self._robot, self._speeds, self._turns
        first, lasts, then = (speeds[:, k : k + 1] for k in range(3))
        vx = _ramped(twist.vx, first, lasts, then, robot.linear_acceleration, robot.linear_deceleration)
        first, lasts, then = (turns[:, k : k + 1] for k in range(3))
        wz = _ramped(twist.wz, first, lasts, then, robot.angular_acceleration, robot.angular_acceleration)
        yaw = pose.yaw + np.cumsum(wz, axis=1) * STEP
        middle = yaw - 0.5 * STEP * wz
        return TrajectoryFan(pose, vx, yaw, np.cos(middle), np.sin(middle), self._speed, self._turn, self.commands)


@dataclass(frozen=True, eq=False)
class TrajectoryFan:
    """Many trajectories, as combinations of few speed profiles and few turn profiles with indices `speed` and `turn`
    (n,).

    Speeds `vx` (k, times), headings `yaw`, and the cosines and sines of the headings in between (m, times).
    """

    pose: Pose2
    vx: Array
    yaw: Array
    cosine: Array
    sine: Array
    speed: npt.NDArray[np.intp]
    turn: npt.NDArray[np.intp]
    commands: Array

    @property
    def ends(self) -> tuple[Array, Array]:
        """Final x and y (n,), except for rounding."""
        speed, turn, (x, y, _) = self.speed, self.turn, self.pose
        along, aside = self.vx @ self.cosine.T, self.vx @ self.sine.T
        return x + along[speed, turn] * STEP, y + aside[speed, turn] * STEP

    def ways(self, which: npt.NDArray[np.intp], moments: int = len(TIMES)) -> Rollouts:
        """Return the trajectories with indices `which` (k,), for the first `moments` time steps."""
        some, turn = np.s_[:, :moments], self.turn[which]
        vx = self.vx[some][self.speed[which]]
        x = self.pose.x + np.cumsum(vx * self.cosine[some][turn], axis=1) * STEP
        y = self.pose.y + np.cumsum(vx * self.sine[some][turn], axis=1) * STEP
        return Rollouts(x, y, self.yaw[some][turn], vx, self.commands[which])


def _ramped(now: float, first: Array, lasts: Array, then: Array, faster: float, slower: float) -> Array:
    """Return velocities (n, times) that ramp from `now` to `first`, and after `lasts` seconds to `then`."""
    up = np.where(np.abs(first) >= abs(now), faster, slower)
    early = now + np.clip(first - now, -up * np.minimum(TIMES, lasts), up * np.minimum(TIMES, lasts))
    change = np.where(np.abs(then) >= np.abs(early), faster, slower) * np.maximum(TIMES - lasts, 0.0)
    ramped: Array = early + np.clip(then - early, -change, change)
    return ramped


class FollowedPath:
    """Path that a controller follows, for predicting its trajectory."""

    def __init__(self, path: Array) -> None:
        """Take the points (n, 2) of the path."""
        self._x, self._y = np.ascontiguousarray(path[:, 0]), np.ascontiguousarray(path[:, 1])
        steps = np.hypot(np.diff(self._x), np.diff(self._y))
        self._along = np.concatenate(([0.0], np.cumsum(steps)))
        self._lengths: list[float] = self._along.tolist()
        self._places: list[complex] = (self._x + 1j * self._y).tolist()

    def __len__(self) -> int:
        return len(self._x)

    def nearest(self, pose: Pose2) -> int:
        """Return the index of the point nearest to a pose."""
        dx, dy = self._x - pose.x, self._y - pose.y
        dx *= dx
        dy *= dy
        dx += dy
        return int(dx.argmin())

    def ahead(self, pose: Pose2, reach: float) -> tuple[float, float]:
        """Return the first point, from the nearest one on, that is `reach` m away from a pose, or the last point."""
        here = self.nearest(pose)
        beyond = np.hypot(self._x[here:] - pose.x, self._y[here:] - pose.y) >= reach
        number = here + int(beyond.argmax()) if beyond.any() else -1
        return float(self._x[number]), float(self._y[number])

    def driven(
        self, pose: Pose2, twist: Twist, wanted: Twist, parts: tuple[float, ...], robot: RobotModel, turns: bool
    ) -> Rollouts:
        """Return the trajectories of a controller that follows the path from here, at fractions of its wanted speed.

        A robot that first turns in place counts as standing. Headings are only computed if `turns`, otherwise 0.
        """
        here, along = self.nearest(pose), self._along
        scale = np.array(parts)[:, None]
        speeds = scale * wanted.vx
        rate = np.where(np.abs(speeds) >= abs(twist.vx), robot.linear_acceleration, robot.linear_deceleration) * TIMES
        vx = twist.vx + np.minimum(np.maximum(speeds - twist.vx, -rate), rate)
        went = np.cumsum(vx, axis=1) * STEP
        came = np.minimum(np.maximum(went, 0.0) + along[here], along[-1])
        fade = np.exp(np.abs(went) / -max(BACK_TO_PATH * abs(wanted.vx), 0.2))
        x = np.interp(came, along, self._x) + (pose.x - self._x[here]) * fade
        y = np.interp(came, along, self._y) + (pose.y - self._y[here]) * fade
        yaw = self._headings(came, here, wanted.vx < 0.0) if turns else np.zeros_like(x)
        return Rollouts(x, y, yaw, vx, scale * (wanted.vx, wanted.wz))

    def course(
        self, pose: Pose2, twist: Twist, wanted: Twist, robot: RobotModel
    ) -> tuple[Callable[[float], complex], float, float]:
        """Return a function for the position (x + iy) of `driven` at full wanted speed after any number of seconds.

        Also return the maximum speed in m/s, and the maximum deviation in m from the time steps of `driven`.
        """
        here, now, then = self.nearest(pose), twist.vx, wanted.vx
        rate = robot.linear_acceleration if abs(then) >= abs(now) else robot.linear_deceleration
        ramp, rate = abs(then - now) / rate, math.copysign(rate, then - now)
        begun, end = self._lengths[here], self._lengths[-1]
        off, fades = complex(pose.x, pose.y) - self._places[here], max(BACK_TO_PATH * abs(then), 0.2)

        def place(seconds: float) -> complex:
            early = min(seconds, ramp)
            went = (now + 0.5 * rate * early) * early + then * (seconds - early)
            return self._at(min(max(went, 0.0) + begun, end)) + off * math.exp(-abs(went) / fades)

        wider = 1.0 + abs(off) / fades
        return place, max(abs(now), abs(then)) * wider, 0.5 * STEP * abs(then - now) * wider

    def _at(self, length: float) -> complex:
        """Return the point at a length along the path."""
        lengths, places = self._lengths, self._places
        after = min(max(bisect_right(lengths, length), 1), len(lengths) - 1)
        before, piece = lengths[after - 1], lengths[after] - lengths[after - 1]
        part = (length - before) / piece if piece > 0.0 else 0.0
        return places[after - 1] + part * (places[after] - places[after - 1])

    def _headings(self, came: Array, here: int, backward: bool) -> Array:
        """Return the headings (…,) at lengths along the path, from the point `here` on."""
        along, x, y = self._along, self._x, self._y
        later = np.minimum(came + 0.1, along[-1])
        before = np.maximum(later - 0.2, along[here])
        yaw: Array = np.arctan2(
            np.interp(later, along, y) - np.interp(before, along, y),
            np.interp(later, along, x) - np.interp(before, along, x),
        )
        return yaw + math.pi if backward else yaw


def arc(pose: Pose2, wanted: Twist, parts: tuple[float, ...]) -> Rollouts:
    """Return the trajectories of a constant command at fractions of its velocity, for a robot without a path."""
    scale = np.array(parts)[:, None]
    vx, wz = scale * wanted.vx + 0.0 * TIMES, scale * wanted.wz + 0.0 * TIMES
    yaw = pose.yaw + wz * TIMES
    middle = yaw - 0.5 * STEP * wz
    x = pose.x + np.cumsum(vx * np.cos(middle), axis=1) * STEP
    y = pose.y + np.cumsum(vx * np.sin(middle), axis=1) * STEP
    return Rollouts(x, y, yaw, vx, np.column_stack((scale * wanted.vx, scale * wanted.wz)))
