"""Poses of the robot in the map and odom frames (REP 105), and the transform between both."""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array


class Frames(NamedTuple):
    """The estimated pose of the robot in the map frame, and its odometry pose in the odom frame.

    The pose in the map frame jumps when the localizer corrects it; odometry is continuous but drifts.
    """

    pose: Pose2
    odometry: Pose2

    @property
    def map_from_odom(self) -> Pose2:
        """The transform that a localizer publishes: pose of the odom frame in the map frame."""
        return self.pose.compose(self.odometry.inverse())

    @property
    def odom_from_map(self) -> Pose2:
        """The inverse transform."""
        return self.odometry.compose(self.pose.inverse())

    def map_shift(self, earlier_odom_from_map: Pose2, radius: float) -> float:
        """Return how far in m the map has moved in the odom frame since `odom_from_map` had an earlier value.

        The result is an upper bound for all points of the map within `radius` m of the robot: the shift of the map at
        the position of the robot, plus the rotation of the map times the radius.
        """
        x, y, yaw = earlier_odom_from_map
        map_x, map_y, map_yaw = self.pose
        odom_x, odom_y, odom_yaw = self.odometry
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = x + c * map_x - s * map_y - odom_x, y + s * map_x + c * map_y - odom_y
        return math.hypot(dx, dy) + radius * abs(math.remainder(yaw + map_yaw - odom_yaw, math.tau))


def transform_poses(frame: Pose2, poses: Array) -> Array:
    """Return poses (n, 3) given in `frame`, expressed in its parent frame."""
    moved = np.empty((len(poses), 3))
    moved[:, :2], moved[:, 2] = frame.apply(poses[:, :2]), wrap_array(poses[:, 2] + frame.yaw)
    return moved
