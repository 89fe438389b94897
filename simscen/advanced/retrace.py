"""Trail of a robot: the poses that it came through, in reverse order, without loops and evenly spaced."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.stack.behaviors.motions import TIME_ALLOWANCE_S
from simscen.stack.footprint import Mask, distance_at, lethal_near
from simscen.stack.path_geometry import poses_along
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel
from simscen.stack.setting import Setting

STEP = 0.01
"""Distance in m that the footprint moves between two poses of a trail, including rotation."""
AGAIN, LOOP = 0.12, 0.3
"""A loop, which is removed, returns to within AGAIN m of a pose after the footprint has moved by at least LOOP m."""
ASIDE = 0.1
"""Share of lateral motion above which the base has strafed; a slipping base has less."""


class Trail:
    """Poses (n, 3) to drive back along, starting at the robot, and the distance (n,) that the footprint moves to each.

    Beyond the known part, the trail continues straight backward.
    """

    def __init__(self, way: Sequence[Pose2], pose: Pose2, lever: float, length: float) -> None:
        """Take earlier poses (oldest first), the current one, the circumscribed radius and the minimum length in m."""
        self._lever = lever
        came = self._thinned(np.array([pose, *reversed(way)], dtype=np.float64))
        self.strafed = _strafed(came)
        """Whether the base moved sideways."""
        back = self._without_loops(came)
        x, y, yaw = back[-1].tolist()
        end = (x - length * math.cos(yaw), y - length * math.sin(yaw), yaw)
        self.known = len(self._even(back))
        """Number of poses that the robot really came through."""
        self.poses = self._even(np.concatenate((back, [end])))
        self.along = np.concatenate(([0.0], np.cumsum(self.apart(self.poses[1:], self.poses[:-1]))))
        steps = np.hypot(np.diff(self.poses[:, 0]), np.diff(self.poses[:, 1]))
        self.driven = np.concatenate(([0.0], np.cumsum(steps)))
        """Distance (n,) in m that the base drives to each pose."""

    def apart(self, poses: Array, others: Array) -> Array:
        """Return the distances (…,) in m that the footprint moves from poses (…, 3) to others."""
        turned = np.abs(wrap_array(poses[..., 2] - others[..., 2]))
        return np.asarray(
            np.hypot(poses[..., 0] - others[..., 0], poses[..., 1] - others[..., 1]) + self._lever * turned
        )

    def _thinned(self, back: Array) -> Array:
        """Return poses between which the footprint moves by at least STEP."""
        kept = [0]
        for k in range(1, len(back)):
            if self.apart(back[k], back[kept[-1]]) >= STEP:
                kept.append(k)
        return back[kept]

    def _without_loops(self, back: Array) -> Array:
        """Return the poses without loops, in which the robot returns to an earlier pose."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        kept, k = [0], 0
        while k < len(back) - 1:
            near = (self.apart(back, back[k]) <= AGAIN) & (moved >= moved[k] + LOOP)
            k = int(near.nonzero()[0][-1]) if near.any() else k + 1
            kept.append(k)
        return back[kept]

    def _even(self, back: Array) -> Array:
        """Return the poses resampled evenly."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        at = np.arange(0.0, moved[-1], STEP)
        back = np.column_stack((back[:, :2], np.unwrap(back[:, 2])))
        return np.column_stack([np.interp(at, moved, column) for column in back.T])


def _strafed(came: Array) -> bool:
    steps, yaw = np.diff(came[:, :2], axis=0), came[:-1, 2] + wrap_array(np.diff(came[:, 2])) / 2
    aside = np.abs(np.cos(yaw) * steps[:, 1] - np.sin(yaw) * steps[:, 0])
    return bool(aside.sum() > ASIDE * np.hypot(*steps.T).sum())


AHEAD = 1.0
"""Horizon in s of each candidate command: 15 cm at Nav2's backup_speed."""
TIMES: Array = np.linspace(0.0, AHEAD, 11)
AT_LEAST = 3
"""Number of steps of TIMES that must be free if no command is free for the whole horizon."""
SLACK = 0.3
"""Cells by which the robot may come closer to an obstacle than on its trail."""
OFF = 2.0
"""Weight of the deviation from the trail relative to the progress along it."""
GAIN = 0.01
"""Minimum advantage in m of a command over standing still."""
WINDOW = 0.5
"""Length in m of the trail in which the robot is located."""
SPEEDS = (-1.0, -0.5, 0.0, 0.5)
"""Candidate speeds relative to the maximum; also forward, because a trail can have cusps."""
RATES = (0.0, 0.07, -0.07, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8)
"""Candidate turn rates in rad/s."""
SIDEWAYS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Candidate lateral speeds relative to the maximum, for a holonomic base whose trail has lateral motion."""


class TrailFollower:
    """Follows the trail of the robot backward; straight backward where there is no trail.

    A robot that stands at an angle between two posts can neither turn nor leave in a straight line, but it can leave
    the way it entered. Each step compares a few velocities on the local costmap and takes the one with the most
    progress along the trail, so that slipping wheels do not lead the robot away from it.
    """

    def __init__(self, setting: Setting, speed: float) -> None:
        """Take the setting of the behavior and the maximum speed in m/s."""
        self._footprint, self._way, self._allowed = setting.footprint, setting.trail, setting.limit_command
        self.speed = min(speed, setting.robot.max_reverse)
        """Speed in m/s; 0 for a robot that cannot reverse."""
        self._last: Pose2 | None = None
        self._commands = _possible(setting.robot, self.speed)

    def start(self, pose: Pose2, length: float) -> None:
        """Start at this pose in the odom frame, to drive back at most `length` m."""
        there = np.array([AHEAD])
        self._ends = np.stack([poses_along(Pose2(0.0, 0.0), each, there)[0] for each in (*self._commands, STOP)])
        lever = self._footprint.circumscribed
        self._trail, self._at = Trail(self._came(), pose, lever, length + self.speed * AHEAD), 0
        self._last = pose

    def _came(self) -> Sequence[Pose2]:
        """Return the poses of the trail, without the part that was already driven back."""
        way = self._way()
        if self._last is None or self._last not in way:
            return way
        since = len(way) - way[::-1].index(self._last)
        rest = self._trail.poses[self._at : self._trail.known]
        return [*(Pose2(*each) for each in rest[::-1].tolist()), *way[since:]]

    def locate(self, pose: Pose2) -> None:
        """Locate the robot on the trail; it never moves forward on it."""
        ahead, self._last = self._ahead(), pose
        self._at += int(self._trail.apart(self._trail.poses[ahead], np.array(pose)).argmin())

    @property
    def driven(self) -> float:
        """Distance in m that the base has driven back."""
        return float(self._trail.driven[self._at])

    @property
    def moved(self) -> float:
        """Distance in m that the footprint has moved, including rotation."""
        return float(self._trail.along[self._at])

    def _ahead(self) -> slice:
        along = self._trail.along
        return slice(self._at, int(np.searchsorted(along, along[self._at] + WINDOW, side="right")))

    def command(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Return the free command with the most progress, or one that is free for a moment, or None.

        None means that standing still is as good. If the collision monitor rejects the best command, because it sees
        obstacles more precisely than the costmap, any other command that leads back is tried.
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
        """Return which of the poses (n, 3) collide, unless the robot collided as much on its trail or does so now.

        The robot has passed the trail, so that apparent collisions there by less than a cell are errors of the costmap;
        deeper ones are obstacles that appeared later.
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
        """Return the progress (commands + 1,) of each command minus its deviation from the trail; last, of a stop."""
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
    """Return the candidate commands of a robot."""
    commands = list[Twist]()
    for part, side, rate in product(SPEEDS, SIDEWAYS if robot.max_lateral > 0.0 else (0.0,), RATES):
        fastest = robot.max_angular
        if robot.turning_radius > 0.0:
            fastest = min(fastest, abs(part) * speed / robot.turning_radius)
        turn = max(-fastest, min(rate, fastest))
        commands.append(Twist(part * speed, side * min(speed, robot.max_lateral), turn))
    return [each for each in dict.fromkeys(commands) if each != STOP]


SLOWLY = 1.5
"""Factor on the time that the distance takes at full speed, before the behavior times out."""


class Retrace:
    """Drives back along the trail of the robot until it can turn in place."""

    name = "retrace"

    def __init__(self, spec: model.Retrace, setting: Setting) -> None:
        """Take the parameters and the setting of the behavior."""
        self._spec, self._footprint = spec, setting.footprint
        self._back = TrailFollower(setting, spec.backup_speed)

    def start(self, pose: Pose2) -> None:
        """Start the behavior at this pose."""
        self._back.start(pose, max(self._spec.backup_dist, self._spec.retrace_dist))

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the command, or None when the robot is far enough back or cannot get any further.

        Raises BACKUP_COLLISION_AHEAD if the robot cannot move by a single cell, BACKUP_TIMEOUT, or
        BACKUP_INVALID_INPUT.
        """
        back = self._back
        if back.speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        back.locate(pose)
        if back.driven >= self._spec.retrace_dist:
            return None
        if back.driven >= self._spec.backup_dist and self._may_turn(pose, costmap):
            return None
        if seconds > max(TIME_ALLOWANCE_S, SLOWLY * self._spec.retrace_dist / back.speed):
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "driving back along the trail took too long")
        command = back.command(pose, costmap)
        if command is None and back.moved < costmap.resolution:
            raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "the trail is blocked")
        return command

    def _may_turn(self, pose: Pose2, costmap: CostmapView) -> bool:
        return distance_at(costmap, pose.x, pose.y) > self._footprint.circumscribed + costmap.resolution
