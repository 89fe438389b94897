"""Turning in place where the hull has corners: only where all of the turn has room, else back out first."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.arcs import poses_along
from simscen.stack.footprint import Footprint, distance_at
from simscen.stack.protocols import CostmapView
from simscen.stack.time_to_collision import time_to_collision

ROOM = 1.01
"""Cells between the hull and the nearest lethal cell's center that a turn must keep: cells stand for obstacles that
may reach half a cell nearer, and behind the robot no scan corrects them."""
BACK_OUT, AHEAD = 0.15, 1.0
"""m/s of backing out, Nav2's backup_speed, and seconds of free way that it needs."""
BENDS = (0.0, 0.3, -0.3, 0.6, -0.6)
"""Turn rates in rad/s that are tried in this order: one that drove in on a bend cannot leave straight."""


class TurningRoom:
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
        return bool((room >= min(ROOM * costmap.resolution, float(room[0]))).all())

    def back_out(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Back, where the robot came from, as straight as is free; None when all bends are blocked, too."""
        backs = (Twist(-BACK_OUT, 0.0, rate) for rate in BENDS)
        return next(
            (one for one in backs if time_to_collision(self._footprint, costmap, pose, one, AHEAD) >= AHEAD), None
        )
