"""Time for which the robot can keep a velocity before its footprint touches a lethal cell."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.arcs import MIN_YAW_RATE, poses_along
from simscen.stack.footprint import Footprint, distance_at, distances, lethal_near
from simscen.stack.protocols import CostmapView


def time_to_collision(footprint: Footprint, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> float:
    """Return the time in s until the first collision at this velocity, at most `horizon`.

    A robot that is in collision according to the costmap, for example because of a localization error, may move unless
    that brings it further into the same obstacle by more than half a cell, or into another one. Otherwise, it could
    never leave the collision.
    """
    if _clearly_free(footprint.circumscribed, costmap, pose, twist, horizon):
        return horizon
    speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * footprint.reach
    steps = max(2, math.ceil(horizon * speed / costmap.resolution) + 1)
    times = np.linspace(0.0, horizon, steps)
    poses = poses_along(pose, twist, times)
    blocked = ~footprint.free(costmap, poses)
    if blocked[0]:
        blocked = _is_worse(footprint, costmap, poses)
    if not blocked.any():
        return horizon
    return float(times[max(0, int(blocked.argmax()) - 1)])


def _is_worse(footprint: Footprint, costmap: CostmapView, poses: Array) -> npt.NDArray[np.bool_]:
    """Return which of the poses (n, 3) are further inside a lethal cell than the first pose, or inside another one."""
    reach = footprint.circumscribed + float(np.hypot(*(poses[:, :2] - poses[0, :2]).T).max()) + costmap.resolution
    gaps = footprint.gaps(lethal_near(costmap, poses[0, 0].item(), poses[0, 1].item(), reach), poses)
    further = gaps < np.minimum(gaps[0] - 0.5 * costmap.resolution, 0.0)
    off = distances(costmap, poses[:, :2]) <= 0.0
    return np.asarray(further.any(axis=1) | (off & ~off[0]))


def _clearly_free(radius: float, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> bool:
    """Return True if a disc of `radius` is free along the whole arc. Each step is as long as the free distance.

    Half a cell diagonal is added at both ends of a step, because distances are known between cell centers. This quick
    check avoids the check of all poses in open space.
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
