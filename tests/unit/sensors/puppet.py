"""Robot with a given motion, and walls around it, for tests of sensors."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.ray_fans import RayCaster


@dataclass
class Puppet:
    """SensorView whose true state is set by the test.

    linear, angular: velocity of the base in m/s and rad/s, world frame
    wheel_angles: encoder angles in rad, in the order of the drive's wheels
    pressed: whether an obstacle touches the hull
    placement_count: how often the robot was teleported
    """

    pose: Pose3 = Pose3()
    linear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wheel_angles: tuple[float, ...] = (0.0, 0.0)
    pressed: bool = False
    placement_count: int = 0

    def base_pose(self):
        return self.pose

    def base_velocity(self):
        return self.linear, self.angular

    def placements(self):
        return self.placement_count

    def encoders(self):
        return self.wheel_angles

    def touching(self):
        return self.pressed

    def image(self, mount, width, height, field_of_view, far):
        return np.zeros((height, width, 3), np.uint8), np.full((height, width), np.inf, np.float32)


class SquareRoom(RayCaster):
    """Four walls at x = ± `half` and y = ± `half` in m, with distances in closed form."""

    def __init__(self, half):
        self.half = half

    def cast(self, origins, directions, reach=math.inf):
        with np.errstate(divide="ignore", invalid="ignore"):
            walls = (np.sign(directions[:, :2]) * self.half - origins[:, :2]) / directions[:, :2]
        return np.nanmin(np.where(walls > 0, walls, np.inf), axis=1)


class EmptyWorld(RayCaster):
    """World without obstacles."""

    def cast(self, origins, directions, reach=math.inf):
        return np.full(len(origins), np.inf)


def puppet_at(x, y, yaw=0.0):
    return Puppet(Pose3.planar(Pose2(x, y, yaw)))
