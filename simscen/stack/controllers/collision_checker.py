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
"""Speed below which a command is not slowed further: the path counts as blocked."""
SPEED_FACTORS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Factors by which a command is slowed to let moving obstacles pass."""
MAX_TIME_STEP_S, UNCERTAINTY_SIGMAS = 0.1, 0.5
"""Largest time between two collision checks, and standard deviations by which obstacles are enlarged."""
APPROACH_TOLERANCE_M = 1e-4
"""Decrease of the distance from which a robot that is already too near counts as approaching."""


class CollisionChecker:
    """Checks the arc of a command for collisions, and slows the command down if a collision is too near."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def seconds(self, costmap: CostmapView, pose: Pose2, command: Twist, horizon: float) -> float:
        """Return how long the command can be driven without touching a static obstacle, in s, at most `horizon`."""
        return horizon if command == STOP else time_to_collision(self._footprint, costmap, pose, command, horizon)

    def within(self, command: Twist, free: float, horizon: float, demanded: float) -> Twist:
        """Return the command, slowed so that the free time becomes `demanded` s. Raises NO_VALID_CONTROL.

        Nav2 fails at once. Slowing down first gives the planner time to find a way around the obstacle.
        """
        if free >= horizon:
            return command
        scale = free / demanded
        if max(abs(command.vx), abs(command.vy)) * scale < MIN_SPEED_M_S:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free:.2f} s")
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale)

    def letting_pass(self, command: Twist, costmap: CostmapView, pose: Pose2, horizon: float) -> Twist:
        """Return the fastest fraction of the command that hits no moving obstacle, or the one that hits it last.

        Robot and obstacles are compared at equal times: the robot does not slow down for one that will have left
        by then. Stopping is no failure, because a moving obstacle goes on.
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
"""Speed of backing up (Nav2's backup_speed), and time for which the way back must be free."""
BACKUP_TURN_RATES_RAD_S = (0.0, 0.3, -0.3, 0.6, -0.6)
"""Turn rates tried in this order: a robot that entered on a curve may not be able to leave straight."""


class RotationClearance:
    """Checks whether a hull with corners can rotate in place where it is.

    A turn that is begun without room for all of it wedges the robot: its corners come nearer to obstacles with every
    step, until it can neither turn nor leave.
    """

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def has_room(self, angle: float, pose: Pose2, costmap: CostmapView) -> bool:
        """Return whether a rotation by `angle` rad keeps the required clearance, or all that there is now."""
        reach = self._footprint.reach
        if reach == 0.0 or distance_at(costmap, pose.x, pose.y) > reach + 2.0 * costmap.resolution:
            return True
        steps = max(2, math.ceil(abs(angle) * reach / costmap.resolution) + 1)
        poses = poses_along(pose, Twist(0.0, 0.0, angle), np.linspace(0.0, 1.0, steps))
        room = self._footprint.clearance(costmap, poses)
        return bool((room >= min(ROTATION_CLEARANCE_CELLS * costmap.resolution, float(room[0]))).all())

    def back_out(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Return a command that backs up as straight as possible; None if every curvature is blocked."""
        backs = (Twist(-BACKUP_SPEED_M_S, 0.0, rate) for rate in BACKUP_TURN_RATES_RAD_S)
        return next(
            (
                one
                for one in backs
                if time_to_collision(self._footprint, costmap, pose, one, BACKUP_FREE_TIME_S) >= BACKUP_FREE_TIME_S
            ),
            None,
        )
