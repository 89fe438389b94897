"""Pose of the robot in the map frame and in the odom frame, and the transform between them (REP 105)."""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array, Pose2, wrap_array


class Frames(NamedTuple):
    """The estimated pose of the robot in the map frame, and its odometry pose in the odom frame.

    The pose in the map frame jumps when the localizer corrects it; odometry is continuous but drifts.
    """

    pose: Pose2
    odometry: Pose2

    @property
    def map_from_odom(self) -> Pose2:
        """The transform that a localizer publishes."""
        return self.pose.compose(self.odometry.inverse())

    @property
    def odom_from_map(self) -> Pose2:
        """The inverse transform."""
        return self.odometry.compose(self.pose.inverse())

    def moved(self, odom_from_map: Pose2, reach: float) -> float:
        """Return by how many meters points within `reach` m of the robot have moved in the odom frame.

        `odom_from_map` is the earlier transform to compare with.
        """
        (x, y, yaw), (mapped_x, mapped_y, mapped_yaw), (now_x, now_y, now_yaw) = odom_from_map, self.pose, self.odometry
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = x + c * mapped_x - s * mapped_y - now_x, y + s * mapped_x + c * mapped_y - now_y
        return math.hypot(dx, dy) + reach * abs(math.remainder(yaw + mapped_yaw - now_yaw, math.tau))


def transform_poses(frame: Pose2, poses: Array) -> Array:
    """Return poses (n, 3) given in `frame`, expressed in its parent frame."""
    moved = np.empty((len(poses), 3))
    moved[:, :2], moved[:, 2] = frame.apply(poses[:, :2]), wrap_array(poses[:, 2] + frame.yaw)
    return moved


def transform_polygon(frame: Pose2, polygon: Polygon) -> Polygon:
    """Return a polygon given in `frame`, expressed in its parent frame."""
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    return tuple((frame.x + c * x - s * y, frame.y + s * x + c * y) for x, y in polygon)
