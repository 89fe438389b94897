"""How long the robot can keep a velocity before its hull meets a lethal cell."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.stack.arcs import poses_along
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView


def time_free(footprint: Footprint, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> float:
    """Seconds until the first collision at this velocity; `horizon` when there is none before.

    A robot that seems to be in collision already (its map or its belief is off by a few centimetres) may move as long
    as that brings it no more than half a cell nearer to the obstacle: otherwise it could never get out.
    """
    speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * footprint.reach
    steps = max(2, math.ceil(horizon * speed / costmap.resolution) + 1)
    times = np.linspace(0.0, horizon, steps)
    poses = poses_along(pose, twist, times)
    blocked = ~footprint.free(costmap, poses)
    if not blocked.any():
        return horizon
    if blocked[0]:
        clearance = footprint.clearance(costmap, poses)
        worse = clearance < clearance[0] - 0.5 * costmap.resolution
        blocked &= worse
        if not blocked.any():
            return horizon
    return float(times[max(0, int(blocked.argmax()) - 1)])
