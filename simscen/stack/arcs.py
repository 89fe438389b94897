"""The motion of a base at a constant velocity: arcs, in closed form (Thrun et al., Probabilistic Robotics, eq. 5.9)."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import Twist

NO_TURN = 1e-6
"""rad/s below which an arc is a straight line."""


def poses_along(pose: Pose2, twist: Twist, times: Array) -> Array:
    """Poses (n, 3) of a base that starts at `pose` and keeps its `twist`, after `times` (n,) seconds."""
    yaw = pose.yaw + twist.wz * times
    if abs(twist.wz) < NO_TURN:
        forward, left = times, np.zeros_like(times)
    else:
        forward = np.sin(twist.wz * times) / twist.wz
        left = (1.0 - np.cos(twist.wz * times)) / twist.wz
    x = twist.vx * forward - twist.vy * left
    y = twist.vx * left + twist.vy * forward
    cosine, sine = np.cos(pose.yaw), np.sin(pose.yaw)
    poses = np.empty((len(times), 3))
    poses[:, 0], poses[:, 1], poses[:, 2] = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y, yaw
    return poses
