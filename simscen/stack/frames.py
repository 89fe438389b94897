"""Poses of the robot in the map and odom frames (REP 105), and the transform between both."""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array


class Frames(NamedTuple):
    """Pose of the robot in the map frame and in the odom frame.

    pose:      estimated pose in the map frame, which jumps when the localizer corrects it
    odometry:  pose in the odom frame, which is continuous but drifts
    """

    pose: Pose2
    odometry: Pose2

    @property
    def map_from_odom(self) -> Pose2:
        """The transform that a localizer publishes: pose of the odom frame in the map frame."""
        return self.pose.compose(self.odometry.inverse())

    @property
    def odom_from_map(self) -> Pose2:
        """The inverse transform: pose of the map frame in the odom frame."""
        return self.odometry.compose(self.pose.inverse())

    def map_shift(self, earlier_odom_from_map: Pose2, radius: float) -> float:
        """Return the distance in m that the map has moved in the odom frame since an earlier transform.

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
    """Return poses (n, 3), given in `frame`, in the parent frame of `frame`."""
    transformed = np.empty((len(poses), 3))
    transformed[:, :2], transformed[:, 2] = frame.apply(poses[:, :2]), wrap_array(poses[:, 2] + frame.yaw)
    return transformed
