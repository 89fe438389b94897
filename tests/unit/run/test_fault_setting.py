"""Tests of HypotheticalSensor, which computes what a sensor would measure at the current pose."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from simscen.core.geometry import Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages.sensor_data import Scan
from simscen.model.sensors import Lidar, Mount
from simscen.run.faults.fault_setting import HypotheticalSensor

HEIGHT = 0.3


class EmptyWorld(RayCaster):
    def cast(self, origins, directions, reach=math.inf):
        return np.full(len(origins), np.inf)


@pytest.mark.parametrize("pitch", [0.0, 0.1])
def test_beams_of_a_level_lidar_end_at_the_floor_if_the_robot_is_tilted(pitch):
    robot = SimpleNamespace(base_pose=lambda: Pose3.from_rpy(1.0, 2.0, 0.0, 0.0, pitch, 0.5))
    lidar = HypotheticalSensor("lidar", Lidar(mount=Mount(z=HEIGHT)), robot, lambda: 0, lambda _: EmptyWorld())
    scan = Scan("lidar", 0, np.zeros(3), -math.pi / 2, math.pi / 2, 0.1, 12.0)
    right, ahead, left = lidar.distances(scan)
    assert ahead == pytest.approx(HEIGHT * math.cos(pitch) / math.sin(pitch) if pitch else math.inf)
    assert right == left == math.inf
