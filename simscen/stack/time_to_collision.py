"""How long the robot can keep a velocity before its hull meets a lethal cell."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.arcs import MIN_YAW_RATE, poses_along
from simscen.stack.footprint import Footprint, distance_at, distances, lethal_near
from simscen.stack.protocols import CostmapView


def time_to_collision(footprint: Footprint, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> float:
    """Seconds until the first collision at this velocity; `horizon` when there is none before.

    A robot that seems to be in collision already (its map or its belief is off by a few centimeters) may move as long
    as that brings what it is in no more than half a cell further in: otherwise it could never get out. Into nothing
    else, though: who touches a post with one side may not back into the next.
    """
    if _clearly_free(footprint.circumscribed, costmap, pose, twist, horizon):
        return horizon
    speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * footprint.reach
    steps = max(2, math.ceil(horizon * speed / costmap.resolution) + 1)
    times = np.linspace(0.0, horizon, steps)
    poses = poses_along(pose, twist, times)
    blocked = ~footprint.free(costmap, poses)
    if blocked[0]:
        blocked = _worse(footprint, costmap, poses)
    if not blocked.any():
        return horizon
    return float(times[max(0, int(blocked.argmax()) - 1)])


def _worse(footprint: Footprint, costmap: CostmapView, poses: Array) -> npt.NDArray[np.bool_]:
    """Which of the poses (n, 3) are further in a lethal cell than the first one, or in another."""
    reach = footprint.circumscribed + float(np.hypot(*(poses[:, :2] - poses[0, :2]).T).max()) + costmap.resolution
    gaps = footprint.gaps(lethal_near(costmap, poses[0, 0].item(), poses[0, 1].item(), reach), poses)
    further = gaps < np.minimum(gaps[0] - 0.5 * costmap.resolution, 0.0)
    off = distances(costmap, poses[:, :2]) <= 0.0
    return np.asarray(further.any(axis=1) | (off & ~off[0]))


def _clearly_free(radius: float, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> bool:
    """Whether a disc of `radius` has room all along, by steps as long as the room there is: mostly two or three.

    Half a cell's diagonal on both ends of a step is kept, as distances are known between cells. In the open this takes
    3 µs where checking all poses takes 60.
    """
    vx, vy, wz = twist
    speed, turns = math.hypot(vx, vy), abs(wz) >= MIN_YAW_RATE
    cosine, sine, resolution = math.cos(pose.yaw), math.sin(pose.yaw), costmap.resolution
    slack = radius + 1.4143 * resolution
    time, at_x, at_y = 0.0, pose.x, pose.y
    while True:
        room = distance_at(costmap, at_x, at_y) - slack
        if room <= resolution and (room <= 0.0 or speed > 0.0):
            return False
        if time >= horizon or speed == 0.0:
            return True
        time += room / speed
        time = min(time, horizon)
        forward, left = (math.sin(wz * time) / wz, (1.0 - math.cos(wz * time)) / wz) if turns else (time, 0.0)
        x, y = vx * forward - vy * left, vx * left + vy * forward
        at_x, at_y = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y
