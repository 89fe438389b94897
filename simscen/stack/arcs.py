"""The motion of a base at a constant velocity: arcs, in closed form (Thrun et al., Probabilistic Robotics, eq. 5.9)."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import Twist

NO_TURN = 1e-6
"""rad/s below which an arc is a straight line."""


def poses_along(pose: Pose2, twist: Twist, times: Array) -> Array:
    """Poses (n, 3) of a base that starts at `pose` and keeps its `twist`, after `times` (n,) seconds."""
    vx, vy, wz = twist
    turned = wz * times
    if abs(wz) < NO_TURN:
        x, y = vx * times, vy * times
    else:
        forward, left = np.sin(turned) / wz, (1.0 - np.cos(turned)) / wz
        x, y = (vx * forward, vx * left) if vy == 0.0 else (vx * forward - vy * left, vx * left + vy * forward)
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    poses = np.empty((len(times), 3))
    poses[:, 0], poses[:, 1], poses[:, 2] = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y, turned
    poses[:, 2] += pose.yaw
    return poses
