"""Where the robot may be in the next seconds: what it can do, moment by moment."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import Twist
from simscen.stack.protocols import RobotModel

STEP, HORIZON = 0.1, 3.0
"""Seconds between two moments, and up to the last."""
FIRST = (0.5, 1.2)
"""Seconds for which the first of two velocities is kept."""
SPEEDS = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
"""Parts of full speed that are tried first."""
TURNS = (0.0, 0.1, 0.3, 0.6, 1.0)
"""Parts of the greatest turn rate that are tried first, to either side."""
THEN = (0.0, 0.5, 1.0)
"""Parts of full speed that are tried after that, straight on or turned back."""
TURN_MOST = 3.0
"""rad/s, where the robot could turn faster."""
BACK_TO_PATH = 0.7
"""Seconds in which a controller takes the robot back to its path, about."""

TIMES: Array = np.arange(1, round(HORIZON / STEP) + 1, dtype=np.float64) * STEP


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Ways (n, moments) of the robot: positions and headings at TIMES, and the command (n, 2) that begins each."""

    x: Array
    y: Array
    yaw: Array
    vx: Array
    commands: Array


class Repertoire:
    """Two velocities, one after the other, all that a base can be told: as fast as its motors reach them."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
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
        self._plan = plan

    def roll(self, pose: Pose2, twist: Twist) -> Rollouts:
        """All of it, from here."""
        plan, robot = self._plan, self._robot
        first_v, first_w, lasts, then_v, then_w = (plan[:, k : k + 1] for k in range(5))
        vx = _ramped(twist.vx, first_v, lasts, then_v, robot.linear_acceleration, robot.linear_deceleration)
        wz = _ramped(twist.wz, first_w, lasts, then_w, robot.angular_acceleration, robot.angular_acceleration)
        yaw = pose.yaw + np.cumsum(wz, axis=1) * STEP
        middle = yaw - 0.5 * STEP * wz
        x = pose.x + np.cumsum(vx * np.cos(middle), axis=1) * STEP
        y = pose.y + np.cumsum(vx * np.sin(middle), axis=1) * STEP
        return Rollouts(x, y, yaw, vx, plan[:, :2])


def _ramped(now: float, first: Array, lasts: Array, then: Array, faster: float, slower: float) -> Array:
    """Velocities (n, moments) that begin at `now`, go to `first`, and after `lasts` seconds to `then`."""
    up = np.where(np.abs(first) >= abs(now), faster, slower)
    early = now + np.clip(first - now, -up * np.minimum(TIMES, lasts), up * np.minimum(TIMES, lasts))
    change = np.where(np.abs(then) >= np.abs(early), faster, slower) * np.maximum(TIMES - lasts, 0.0)
    ramped: Array = early + np.clip(then - early, -change, change)
    return ramped


def along_path(
    pose: Pose2, twist: Twist, path: Array, wanted: Twist, parts: tuple[float, ...], robot: RobotModel
) -> Rollouts:
    """What a controller would do that follows `path` (m, 2) from here, at these parts of the speed that it wants.

    A robot that turns in place first is taken to stand.
    """
    dx, dy = path[:, 0] - pose.x, path[:, 1] - pose.y
    here = int((dx * dx + dy * dy).argmin())
    ahead = path[here:]
    off = np.array([pose.x, pose.y]) - ahead[0]
    steps = np.diff(ahead, axis=0)
    along = np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))
    speeds = np.array(parts)[:, None] * wanted.vx
    rate = np.where(np.abs(speeds) >= abs(twist.vx), robot.linear_acceleration, robot.linear_deceleration)
    vx = twist.vx + np.clip(speeds - twist.vx, -rate * TIMES, rate * TIMES)
    came = np.clip(np.cumsum(vx, axis=1) * STEP, 0.0, along[-1])
    fade = np.exp(-np.abs(np.cumsum(vx, axis=1) * STEP) / max(BACK_TO_PATH * abs(wanted.vx), 0.2))
    x = np.interp(came, along, ahead[:, 0]) + off[0] * fade
    y = np.interp(came, along, ahead[:, 1]) + off[1] * fade
    later = np.minimum(came + 0.1, along[-1])
    yaw = np.arctan2(
        np.interp(later, along, ahead[:, 1]) - np.interp(later - 0.2, along, ahead[:, 1]),
        np.interp(later, along, ahead[:, 0]) - np.interp(later - 0.2, along, ahead[:, 0]),
    )
    if wanted.vx < 0.0:
        yaw = yaw + math.pi
    commands = np.column_stack((np.array(parts) * wanted.vx, np.array(parts) * wanted.wz))
    return Rollouts(x, y, yaw, vx, commands)


def arc(pose: Pose2, wanted: Twist, parts: tuple[float, ...]) -> Rollouts:
    """The command kept, at these parts of it; where nobody follows a path."""
    scale = np.array(parts)[:, None]
    vx, wz = scale * wanted.vx + 0.0 * TIMES, scale * wanted.wz + 0.0 * TIMES
    yaw = pose.yaw + wz * TIMES
    middle = yaw - 0.5 * STEP * wz
    x = pose.x + np.cumsum(vx * np.cos(middle), axis=1) * STEP
    y = pose.y + np.cumsum(vx * np.sin(middle), axis=1) * STEP
    return Rollouts(x, y, yaw, vx, np.column_stack((scale * wanted.vx, scale * wanted.wz)))


def joined(first: Rollouts, second: Rollouts) -> Rollouts:
    """Both."""
    names = ("x", "y", "yaw", "vx", "commands")
    return Rollouts(*(np.concatenate((getattr(first, name), getattr(second, name))) for name in names))
