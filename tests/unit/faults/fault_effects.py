"""Functions that start faults, a clock set by tests, and messages that faults change."""

import math

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Imu, Odometry, Scan
from simscen.faults.base import AnyFault, FaultSetting, FaultTarget


class ManualClock:
    """Clock whose ticks of 1/240 s are set by tests."""

    tick = 0

    def __call__(self) -> int:
        return self.tick


def start(fault: dict, kind: str, now=lambda: 0, separation=0.3, seed=1, simulator=None):
    """Return the effect of a fault, written as in a scenario, on messages of a kind, such as Scan or Command."""
    setting = FaultSetting(separation, Clock(240), now, kind, simulator)
    return AnyFault.model_validate(fault).fault.begin(np.random.default_rng(seed), setting)


def unsuitable_key(fault: dict, kind: str, rate=0.0, spec=None):
    """Return the key of the fault that does not suit its target and the reason, or None."""
    return AnyFault.model_validate(fault).fault.unsuitable_key(FaultTarget(kind, rate, spec))


def scan(ranges, tick=0, range_min=0.1, range_max=12.0) -> Scan:
    values = np.asarray(ranges, dtype=float)
    return Scan("lidar", tick, values, -math.pi, 2 * math.pi / len(values), range_min, range_max)


def odometry(pose=Pose2(0, 0), tick=0, twist=STOP) -> Odometry:
    return Odometry("odom", tick, pose, twist)


def imu(tick=0, rates=(0.0, 0.0, 0.2), accelerations=(0.1, 0.0, 9.81)) -> Imu:
    return Imu("imu", tick, rates, accelerations)


def image(depth, tick=0, gray=100) -> Image:
    depths = np.asarray(depth, dtype=np.float32)
    return Image("camera", tick, np.full((*depths.shape, 3), gray, np.uint8), depths)


def belief(pose: Pose2, odom: Pose2) -> Belief:
    """Return a belief with this pose in the map and in the odom frame."""
    return Belief(pose, np.eye(3), pose.compose(odom.inverse()))
