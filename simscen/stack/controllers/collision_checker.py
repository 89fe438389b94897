"""Collision checks of velocity commands, shared by the controllers."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.arcs import poses_along
from simscen.stack.footprint import Footprint, distance_at
from simscen.stack.moving_obstacles import MAX_UNCERTAINTY_M
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.time_to_collision import time_to_collision

MIN_SPEED_M_S = 0.1
"""m/s. When only slower than this would keep the time to collision, the way is blocked."""
SPEED_FACTORS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Parts of a command at which it may let things pass that move."""
MAX_TIME_STEP_S, UNCERTAINTY_SIGMAS = 0.1, 0.5
"""Seconds at most between two moments at which they are compared, and standard deviations by which they count wider."""
APPROACH_TOLERANCE_M = 1e-4
"""Meters: whom one is too near already is met by coming nearer."""


class CollisionChecker:
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
        if max(abs(command.vx), abs(command.vy)) * scale < MIN_SPEED_M_S:
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
        times = np.linspace(0.0, horizon, max(1, math.ceil(horizon / MAX_TIME_STEP_S)) + 1)
        met_at = list[int]()
        for part in SPEED_FACTORS:
            gaps = self._footprint.gap(near, poses_along(pose, command, part * times), times, UNCERTAINTY_SIGMAS)
            met = (gaps[1:] < 0.0) & (gaps[1:] < gaps[0] - APPROACH_TOLERANCE_M)
            if not met.any():
                break
            met_at.append(int(met.argmax()))
        else:
            part = SPEED_FACTORS[met_at.index(max(met_at))]
        return command if part == 1.0 else Twist(part * command.vx, part * command.vy, part * command.wz)


ROTATION_CLEARANCE_CELLS = 1.01
"""Cells between the hull and the nearest lethal cell's center that a turn must keep: cells stand for obstacles that
may reach half a cell nearer, and behind the robot no scan corrects them."""
BACKUP_SPEED_M_S, BACKUP_FREE_TIME_S = 0.15, 1.0
"""m/s of backing out, Nav2's backup_speed, and seconds of free way that it needs."""
BACKUP_TURN_RATES_RAD_S = (0.0, 0.3, -0.3, 0.6, -0.6)
"""Turn rates in rad/s that are tried in this order: one that drove in on a bend cannot leave straight."""


class RotationClearance:
    """Finds out whether a robot can turn where it is.

    A turn that is begun without room for all of it wedges the robot: its corners come nearer to obstacles with every
    step, until it can neither turn nor leave.
    """

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def has_room(self, angle: float, pose: Pose2, costmap: CostmapView) -> bool:
        """Whether the hull keeps its room, or all that it has now, throughout a turn by `angle` rad."""
        reach = self._footprint.reach
        if reach == 0.0 or distance_at(costmap, pose.x, pose.y) > reach + 2.0 * costmap.resolution:
            return True
        steps = max(2, math.ceil(abs(angle) * reach / costmap.resolution) + 1)
        poses = poses_along(pose, Twist(0.0, 0.0, angle), np.linspace(0.0, 1.0, steps))
        room = self._footprint.clearance(costmap, poses)
        return bool((room >= min(ROTATION_CLEARANCE_CELLS * costmap.resolution, float(room[0]))).all())

    def back_out(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Back, where the robot came from, as straight as is free; None when all bends are blocked, too."""
        backs = (Twist(-BACKUP_SPEED_M_S, 0.0, rate) for rate in BACKUP_TURN_RATES_RAD_S)
        return next(
            (
                one
                for one in backs
                if time_to_collision(self._footprint, costmap, pose, one, BACKUP_FREE_TIME_S) >= BACKUP_FREE_TIME_S
            ),
            None,
        )
