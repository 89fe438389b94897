"""`drift`: an error that grows with time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Imu, Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import OdometryDistortion, inapplicable_key
from simscen.faults.range_readings import with_distances
from simscen.spec.base import Spec
from simscen.spec.quantities import AngularAcceleration, AngularSpeed, Speed


class Drift(Spec, Fault):
    """A sensor's error grows from nothing, second by second: electronics that warm up, a gyroscope's bias that walks.

    Odometry creeps: it reports to drive and turn while the robot stands. The localizer slides off along the robot's
    heading of when it began, as a scan matcher does in a corridor without features; the navigator believes it.

    Example: `{sensor: imu, drift: {gyro: 0.01 rad/s^2}, when: {time: 2 s}, for: 10 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image", "Belief"})
    idle: ClassVar[Mapping[str, object]] = dict.fromkeys(("range", "linear", "angular", "gyro"), 0.0)
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("range",),
        "Image": ("range",),
        "Odometry": ("linear", "angular"),
        "Imu": ("gyro",),
        "Belief": ("linear", "angular"),
    }
    range: Speed = 0.0
    """By which each range or depth grows."""
    linear: Speed = 0.0
    """Meters a second forward that odometry adds, or that the belief slides."""
    angular: AngularSpeed = 0.0
    """Radians a second that odometry adds, or that the belief turns."""
    gyro: AngularAcceleration = 0.0
    """By which the bias of the turn rate about the vertical axis grows."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Keys that mean nothing there."""
        return inapplicable_key(self, instance)

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From nothing, now."""
        return _Creeping(self, setting) if setting.kind == "Odometry" else _Drifting(self, setting)


class _Creeping(OdometryDistortion):
    def __init__(self, drift: Drift, setting: FaultSetting) -> None:
        super().__init__()
        self._drift, self._clock = drift, setting.clock

    def increment(self, step: Twist) -> Twist:
        return Twist(step.vx + self._drift.linear, step.vy, step.wz + self._drift.angular)

    def reported(self, step: Twist, twist: Twist, ticks: int) -> tuple[Twist, Twist]:
        seconds = self._clock.seconds(ticks)
        crept = Twist(step.vx + self._drift.linear * seconds, step.vy, step.wz + self._drift.angular * seconds)
        return crept, self.increment(twist)


class _Drifting(Disturbance):
    def __init__(self, drift: Drift, setting: FaultSetting) -> None:
        self._drift, self._setting, self._began = drift, setting, setting.now()
        self._odom: tuple[Pose2, Pose2] | None = None

    def _since(self, tick: int) -> float:
        return self._setting.clock.seconds(max(0, tick - self._began))

    def reading(self, reading: Reading) -> Reading | None:
        since = self._since(reading.tick)
        if isinstance(reading, Imu):
            x, y, z = reading.angular_velocity
            return replace(reading, angular_velocity=(x, y, z + self._drift.gyro * since))
        return with_distances(reading, lambda distances: distances + self._drift.range * since)

    def belief(self, belief: Belief) -> Belief:
        since = self._since(self._setting.now())
        if self._odom is None:
            self._odom = belief.pose, belief.pose.inverse()
        start, back = self._odom
        slid = Pose2(self._drift.linear * since, 0.0, self._drift.angular * since)
        moved = start.compose(slid).compose(back)
        return replace(belief, pose=moved.compose(belief.pose), map_from_odom=moved.compose(belief.map_from_odom))
