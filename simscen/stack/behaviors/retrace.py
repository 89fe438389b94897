"""Driving back the way the robot came. Nav2 has nothing like it."""

import math
from itertools import product

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.stack.arcs import poses_along
from simscen.stack.behaviors.motions import TIME_ALLOWANCE
from simscen.stack.behaviors.trail import Trail
from simscen.stack.footprint import Mask, distance_at, lethal_near
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel
from simscen.stack.setting import Setting

AHEAD = 1.0
"""Seconds for which each command is tried out: 15 cm at Nav2's backup_speed."""
TIMES: Array = np.linspace(0.0, AHEAD, 11)
AT_LEAST = 3
"""Tenths of it for which one must be free, where none is for all."""
SLACK = 0.005
"""Metres by which it may come nearer to something than it came on its way."""
OFF = 2.0
"""Metres of the way that are worth as much as a metre less beside it."""
GAIN = 0.01
"""Metres that a command must be worth more than to stand."""
WINDOW = 0.5
"""Metres of the way ahead among which the robot looks for where it is."""
SPEEDS = (-1.0, -0.5, 0.0, 0.5)
"""Parts of the speed; forward, too, for a way may have had cusps."""
RATES = (0.0, 0.07, -0.07, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8)
"""rad/s."""
SIDEWAYS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Parts of the speed, for a base that can."""


class Retrace:
    """Drive back the way it came, turns included, until there is room to turn.

    Who wedged himself askew between two posts can neither turn nor leave straight; but he came in, so he can go out.
    At each step it tries a few velocities on the local costmap, and drives the one that gets it farthest back while it
    keeps to the way: wheels that slip do not lead it off.
    """

    name = "retrace"

    def __init__(self, spec: model.Retrace, setting: Setting) -> None:
        self._spec, self._robot, self._footprint, self._way = spec, setting.robot, setting.footprint, setting.way
        self._speed = min(spec.backup_speed, self._robot.max_reverse)
        self._commands = _possible(self._robot, self._speed)
        there = np.array([AHEAD])
        self._ends = np.stack([poses_along(Pose2(0.0, 0.0), each, there)[0] for each in (*self._commands, STOP)])

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        length = max(self._spec.backup_dist, self._spec.retrace_dist) + self._speed * AHEAD
        self._trail, self._at = Trail(self._way(), pose, self._footprint.circumscribed, length), 0

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Back on; None when far enough, or when it has come some way and there is none that is free.

        Raises BACKUP_COLLISION_AHEAD when there is not even a cell of room, BACKUP_TIMEOUT, BACKUP_INVALID_INPUT.
        """
        if self._speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        self._at = self._nearest(pose)
        gone = self._trail.driven.item(self._at)
        if gone >= self._spec.retrace_dist or (gone >= self._spec.backup_dist and self._may_turn(pose, costmap)):
            return None
        if seconds > TIME_ALLOWANCE:
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "driving back the way it came took too long")
        command = self._best(pose, costmap)
        if command is not None:
            return command
        if self._trail.along.item(self._at) >= costmap.resolution:
            return None
        raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "no room on the way it came")

    def _nearest(self, pose: Pose2) -> int:
        """Which pose of the trail the robot is at; it never goes down."""
        ahead = self._ahead()
        return self._at + int(self._trail.apart(self._trail.poses[ahead], np.array(pose)).argmin())

    def _ahead(self) -> slice:
        along = self._trail.along
        return slice(self._at, int(np.searchsorted(along, along[self._at] + WINDOW, side="right")))

    def _may_turn(self, pose: Pose2, costmap: CostmapView) -> bool:
        return distance_at(costmap, pose.x, pose.y) > self._footprint.circumscribed + costmap.resolution

    def _best(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """The command that gets it farthest back of those that are free; else of those that are for a moment.

        None where to stand is as good.
        """
        *worth, standing = self._worth(pose).tolist()
        better = sorted((k for k, gets in enumerate(worth) if gets > standing + GAIN), key=lambda k: -worth[k])
        partly: Twist | None = None
        for command in (self._commands[k] for k in better):
            blocked = self._blocked(pose, poses_along(pose, command, TIMES), costmap)
            if not blocked.any():
                return command
            if partly is None and blocked.argmax() > AT_LEAST:
                partly = command
        return partly

    def _blocked(self, pose: Pose2, poses: Array, costmap: CostmapView) -> Mask:
        """Which of the poses (n, 3) are in something, and further than the robot is now, or was on its way here.

        It came, so that what seems to stand there by less than a cell does not; but in what it drove through by more
        something has come to stand since.
        """
        blocked: Mask = ~self._footprint.free(costmap, poses)
        if not blocked.any():
            return blocked
        edge = costmap.resolution
        cells = lethal_near(costmap, pose.x, pose.y, self._footprint.circumscribed + self._speed * AHEAD + edge)
        came = self._footprint.gaps(cells, self._trail.poses[self._ahead()]).min(axis=0)
        now = self._footprint.gaps(cells, np.array([pose]))[0]
        least = np.minimum(np.where(came < -edge, edge, came), np.maximum(now, -edge / 2))
        nearer = self._footprint.gaps(cells, poses) < np.minimum(least, edge) - SLACK
        return np.asarray(blocked & nearer.any(axis=1))

    def _worth(self, pose: Pose2) -> Array:
        """How far back (commands + 1,) each leads, less what it leads beside the way; last, what standing does."""
        cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
        ends = np.column_stack((
            pose.x + cosine * self._ends[:, 0] - sine * self._ends[:, 1],
            pose.y + sine * self._ends[:, 0] + cosine * self._ends[:, 1],
            pose.yaw + self._ends[:, 2],
        ))  # fmt: skip
        ahead = self._ahead()
        off = self._trail.apart(ends[:, None], self._trail.poses[None, ahead])
        worth: Array = (self._trail.along[ahead] - OFF * off).max(axis=1)
        return worth


def _possible(robot: RobotModel, speed: float) -> list[Twist]:
    """What such a base may be told at that speed."""
    commands = list[Twist]()
    for part, side, rate in product(SPEEDS, SIDEWAYS if robot.max_lateral > 0.0 else (0.0,), RATES):
        fastest = robot.max_angular
        if robot.turning_radius > 0.0:
            fastest = min(fastest, abs(part) * speed / robot.turning_radius)
        turn = max(-fastest, min(rate, fastest))
        commands.append(Twist(part * speed, side * min(speed, robot.max_lateral), turn))
    return [each for each in dict.fromkeys(commands) if each != STOP]
