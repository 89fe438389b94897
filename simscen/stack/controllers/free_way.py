"""Whether what a controller is about to drive is free: the check that all of them share."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.arcs import poses_along
from simscen.stack.footprint import Footprint
from simscen.stack.moving_obstacles import MAX_UNCERTAINTY_M
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.time_to_collision import time_to_collision

CREEP = 0.1
"""m/s. When only slower than this would keep the time to collision, the way is blocked."""
PARTS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Parts of a command at which it may let things pass that move."""
MOMENT, SIGMAS = 0.1, 0.5
"""Seconds at most between two moments at which they are compared, and standard deviations by which they count wider."""
NEARER = 1e-4
"""Meters: whom one is too near already is met by coming nearer."""


class FreeWay:
    """Looks along the arc of a command, and slows the command down where the arc is not free for long enough."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def seconds(self, costmap: CostmapView, pose: Pose2, command: Twist, horizon: float) -> float:
        """For how long the command can be driven; `horizon` if for all of it. Of what stands."""
        return horizon if command == STOP else time_to_collision(self._footprint, costmap, pose, command, horizon)

    def within(self, command: Twist, free: float, horizon: float, demanded: float) -> Twist:
        """The command, so slow that what is free now lasts for the seconds demanded. Raises NO_VALID_CONTROL.

        Nav2 fails at once; slowing first lets the planner find a way round before the robot stands before a wall.
        """
        if free >= horizon:
            return command
        scale = free / demanded
        if max(abs(command.vx), abs(command.vy)) * scale < CREEP:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free:.2f} s")
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale)

    def letting_pass(self, command: Twist, costmap: CostmapView, pose: Pose2, horizon: float) -> Twist:
        """The command at the greatest part of it that meets nothing which moves, or if all do, meets it last.

        Both on their ways: who crosses and will have gone is no reason to slow down, and before who will be there the
        robot slows, or stands. That is no failure, for what moves goes on.
        """
        if not costmap.moving.things or command == STOP:
            return command
        reach, speed = self._footprint.discs.reach + MAX_UNCERTAINTY_M, math.hypot(command.vx, command.vy)
        near = costmap.moving.near(pose.x, pose.y, reach, speed, horizon)
        if not near.things:
            return command
        times = np.linspace(0.0, horizon, max(1, math.ceil(horizon / MOMENT)) + 1)
        met_at = list[int]()
        for part in PARTS:
            gaps = self._footprint.gap(near, poses_along(pose, command, part * times), times, SIGMAS)
            met = (gaps[1:] < 0.0) & (gaps[1:] < gaps[0] - NEARER)
            if not met.any():
                break
            met_at.append(int(met.argmax()))
        else:
            part = PARTS[met_at.index(max(met_at))]
        return command if part == 1.0 else Twist(part * command.vx, part * command.vy, part * command.wz)
