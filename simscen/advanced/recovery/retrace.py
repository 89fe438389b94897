"""Which velocity leads a robot back the way it came."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from simscen.advanced.recovery.trail import Trail
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.stack.arcs import poses_along
from simscen.stack.behaviors.motions import TIME_ALLOWANCE
from simscen.stack.footprint import Mask, distance_at, lethal_near
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel
from simscen.stack.setting import Setting

AHEAD = 1.0
"""Seconds for which each command is tried out: 15 cm at Nav2's backup_speed."""
TIMES: Array = np.linspace(0.0, AHEAD, 11)
AT_LEAST = 3
"""Tenths of it for which one must be free, where none is for all."""
SLACK = 0.3
"""Cells by which it may come nearer to something than it came on its way."""
OFF = 2.0
"""Meters of the way that are worth as much as a meter less beside it."""
GAIN = 0.01
"""Meters that a command must be worth more than to stand."""
WINDOW = 0.5
"""Meters of the way ahead among which the robot looks for where it is."""
SPEEDS = (-1.0, -0.5, 0.0, 0.5)
"""Parts of the speed; forward, too, for a way may have had cusps."""
RATES = (0.0, 0.07, -0.07, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8)
"""rad/s."""
SIDEWAYS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Parts of the speed, for a base that can and came so: a controller may have been told not to strafe."""


class TrailFollower:
    """Leads back the way that a robot came, turns included; straight where nobody knows it.

    Who is askew between two posts can neither turn nor leave straight; but he came in, so he can go out. Each step it
    tries a few velocities on the local costmap, and takes the one that gets the robot farthest back while it keeps to
    the way: wheels that slip do not lead it off.
    """

    def __init__(self, setting: Setting, speed: float) -> None:
        """`speed`: m/s at most; less where the base cannot reverse as fast."""
        self._footprint, self._way, self._allowed = setting.footprint, setting.trail, setting.limit_command
        self.speed = min(speed, setting.robot.max_reverse)
        """m/s; 0 for a robot without a reverse gear."""
        self._last: Pose2 | None = None
        self._commands = _possible(setting.robot, self.speed)

    def start(self, pose: Pose2, length: float) -> None:
        """Begin from this pose in the odom frame, to go back so many meters at most."""
        there = np.array([AHEAD])
        self._ends = np.stack([poses_along(Pose2(0.0, 0.0), each, there)[0] for each in (*self._commands, STOP)])
        lever = self._footprint.circumscribed
        self._trail, self._at = Trail(self._came(), pose, lever, length + self.speed * AHEAD), 0
        self._last = pose

    def _came(self) -> Sequence[Pose2]:
        """The way it came; where it has gone back a part of that since, the rest of it, and what came then."""
        way = self._way()
        if self._last is None or self._last not in way:
            return way
        since = len(way) - way[::-1].index(self._last)
        rest = self._trail.poses[self._at : self._trail.known]
        return [*(Pose2(*each) for each in rest[::-1].tolist()), *way[since:]]

    def locate(self, pose: Pose2) -> None:
        """Note where the robot is; it never goes forward again."""
        ahead, self._last = self._ahead(), pose
        self._at += int(self._trail.apart(self._trail.poses[ahead], np.array(pose)).argmin())

    @property
    def driven(self) -> float:
        """Meters that the base has come back."""
        return float(self._trail.driven[self._at])

    @property
    def moved(self) -> float:
        """Meters that its hull has, which a turn moves, too."""
        return float(self._trail.along[self._at])

    def _ahead(self) -> slice:
        along = self._trail.along
        return slice(self._at, int(np.searchsorted(along, along[self._at] + WINDOW, side="right")))

    def command(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """The command that gets it farthest back of those that are free; else of those that are for a moment.

        None where to stand is as good. Who touches a post all but may not turn as the way does, says the monitor, which
        sees by the centimeter what cells do not show: then whatever else leads back, until there is room again.
        """
        *worth, standing = self._worth(pose).tolist()
        strafed, vetoed = self._trail.strafed, False
        possible = [k for k, each in enumerate(self._commands) if strafed or each.vy == 0.0]
        possible.sort(key=lambda k: -worth[k])
        for_now: Twist | None = None
        for k in possible:
            command, gains = self._commands[k], worth[k] > standing + GAIN
            if not gains and (for_now is not None or not vetoed):
                break
            if vetoed and (command.vx > 0.0 or (command.vx == 0.0 and not gains)):
                continue
            blocked = self._blocked(pose, poses_along(pose, command, TIMES), costmap)
            if blocked.any() and (not gains or for_now is not None or blocked.argmax() <= AT_LEAST):
                continue
            if self._allowed(command, pose) == STOP:
                vetoed = True
            elif blocked.any():
                for_now = command
            else:
                return command
        return for_now

    def _blocked(self, pose: Pose2, poses: Array, costmap: CostmapView) -> Mask:
        """Which of the poses (n, 3) are in something, and further than the robot is now, or was on its way here.

        It came, so that what seems to stand there by less than a cell does not; but in what it drove through by more
        something has come to stand since.
        """
        blocked: Mask = ~self._footprint.free(costmap, poses)
        if not blocked.any():
            return blocked
        edge = costmap.resolution
        cells = lethal_near(costmap, pose.x, pose.y, self._footprint.circumscribed + self.speed * AHEAD + edge)
        known = self._trail.poses[self._ahead()][: max(0, self._trail.known - self._at)]
        came = self._footprint.gaps(cells, known).min(axis=0, initial=edge)
        now = self._footprint.gaps(cells, np.array([pose]))[0]
        least = np.minimum(np.where(came < -edge, edge, came), np.maximum(now, -edge / 2))
        nearer = self._footprint.gaps(cells, poses) < np.minimum(least - SLACK * edge, edge / math.sqrt(2.0))
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


SLOWLY = 1.5
"""Times as long as the way takes at full speed it may take, for it is driven in part at half of it."""


class Retrace:
    """Drive back the way it came, turns included, until there is room to turn."""

    name = "retrace"

    def __init__(self, spec: model.Retrace, setting: Setting) -> None:
        self._spec, self._footprint = spec, setting.footprint
        self._back = TrailFollower(setting, spec.backup_speed)

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        self._back.start(pose, max(self._spec.backup_dist, self._spec.retrace_dist))

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Back on; None when far enough, or when it has come some way and there is none that is free.

        Raises BACKUP_COLLISION_AHEAD when there is not even a cell of room, BACKUP_TIMEOUT, BACKUP_INVALID_INPUT.
        """
        back = self._back
        if back.speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        back.locate(pose)
        if back.driven >= self._spec.retrace_dist:
            return None
        if back.driven >= self._spec.backup_dist and self._may_turn(pose, costmap):
            return None
        if seconds > max(TIME_ALLOWANCE, SLOWLY * self._spec.retrace_dist / back.speed):
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "driving back the way it came took too long")
        command = back.command(pose, costmap)
        if command is None and back.moved < costmap.resolution:
            raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "no room on the way it came")
        return command

    def _may_turn(self, pose: Pose2, costmap: CostmapView) -> bool:
        return distance_at(costmap, pose.x, pose.y) > self._footprint.circumscribed + costmap.resolution
