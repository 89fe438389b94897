"""Systematic measurement errors: `bias`, `scale`, and `drift`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Imu, Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import OdometryDistortion, inapplicable_key, with_distances
from simscen.spec.base import Spec
from simscen.spec.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Length,
    Quantity,
    Ratio,
    Speed,
)


class Bias(Spec, Fault):
    """A sensor is off by the same amount all the time: wrong wheel radii, a gyroscope not zeroed, a lidar too warm.

    Odometry reports a scaled distance and turn, plus a steady turn for each meter driven; ranges are too long or too
    short; a gyroscope turns while it stands; a picture is too bright or too dark.

    Example: `{sensor: odom, bias: {linear_scale: 1.1, turn_per_metre: 0.05}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Odometry", "Scan", "Imu", "Image"})
    idle: ClassVar[Mapping[str, object]] = {
        **dict.fromkeys(("linear_scale", "angular_scale"), 1.0),
        **dict.fromkeys(("turn_per_metre", "range", "gyro", "accelerometer", "brightness"), 0.0),
    }
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Odometry": ("linear_scale", "angular_scale", "turn_per_metre"),
        "Scan": ("range",),
        "Imu": ("gyro", "accelerometer"),
        "Image": ("range", "brightness"),
    }
    linear_scale: Ratio = 1.0
    """Reported distance per driven distance: a worn wheel of 95 % radius reports 1.05."""
    angular_scale: Ratio = 1.0
    """Reported turn per true turn."""
    turn_per_metre: Angle = 0.0
    """Radians of turn reported for each meter driven forward: unequal wheel radii."""
    range: Length = 0.0
    """Added to each range or depth."""
    gyro: AngularSpeed = 0.0
    """Added to the turn rate about the vertical axis."""
    accelerometer: Acceleration = 0.0
    """Added to the acceleration forward."""
    brightness: Annotated[float, Field(ge=-1, le=1), Quantity("ratio")] = 0.0
    """Added to each pixel's red, green and blue, of their full scale."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Keys that mean nothing there."""
        return inapplicable_key(self, instance)

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Scale each increment, or add to each value."""
        return _BiasedReadings(self) if setting.kind in ("Scan", "Imu", "Image") else _BiasedOdometry(self)


class _BiasedOdometry(OdometryDistortion):
    def __init__(self, bias: Bias) -> None:
        super().__init__()
        self._bias = bias

    def increment(self, step: Twist) -> Twist:
        turn = step.wz * self._bias.angular_scale + step.vx * self._bias.turn_per_metre
        return Twist(step.vx * self._bias.linear_scale, step.vy * self._bias.linear_scale, turn)


class _BiasedReadings(Disturbance):
    def __init__(self, bias: Bias) -> None:
        self._bias = bias

    def reading(self, reading: Reading) -> Reading | None:
        bias = self._bias
        if isinstance(reading, Imu):
            x, y, z = reading.angular_velocity
            a, b, c = reading.linear_acceleration
            return replace(
                reading, angular_velocity=(x, y, z + bias.gyro), linear_acceleration=(a + bias.accelerometer, b, c)
            )
        told = with_distances(reading, lambda distances: distances + bias.range)
        if isinstance(told, Image) and bias.brightness:
            return replace(told, rgb=np.clip(np.rint(told.rgb + 255 * bias.brightness), 0, 255).astype(np.uint8))
        return told


Factor = Annotated[float, Field(gt=0, le=100), Quantity("ratio")]


class Scale(Spec, Fault):
    """Everything that a sensor measures is too large or too small by a factor.

    Ranges and depths: a clock that runs fast or slow. Odometry: tires with too little air, a wrong gear ratio in the
    driver; both distances and turns. An inertial unit: a wrong full-scale setting; what it measures at rest, too.

    Example: `{sensor: odom, scale: {factor: 105 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image"})
    idle: ClassVar[Mapping[str, object]] = {"factor": 1.0}
    factor: Factor
    """What is said over what is true."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Multiply."""
        return _ScaledOdometry(self.factor) if setting.kind == "Odometry" else _ScaledReadings(self.factor)


class _ScaledOdometry(OdometryDistortion):
    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor

    def increment(self, step: Twist) -> Twist:
        return Twist(*(self._factor * value for value in step))


class _ScaledReadings(Disturbance):
    def __init__(self, factor: float) -> None:
        self._factor = factor

    def reading(self, reading: Reading) -> Reading | None:
        if isinstance(reading, Imu):
            x, y, z = (self._factor * value for value in reading.angular_velocity)
            a, b, c = (self._factor * value for value in reading.linear_acceleration)
            return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
        return with_distances(reading, lambda distances: distances * self._factor)


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
        return _DriftingOdometry(self, setting) if setting.kind == "Odometry" else _DriftingValues(self, setting)


class _DriftingOdometry(OdometryDistortion):
    def __init__(self, drift: Drift, setting: FaultSetting) -> None:
        super().__init__()
        self._drift, self._clock = drift, setting.clock

    def increment(self, step: Twist) -> Twist:
        return Twist(step.vx + self._drift.linear, step.vy, step.wz + self._drift.angular)

    def reported(self, step: Twist, twist: Twist, ticks: int) -> tuple[Twist, Twist]:
        seconds = self._clock.seconds(ticks)
        crept = Twist(step.vx + self._drift.linear * seconds, step.vy, step.wz + self._drift.angular * seconds)
        return crept, self.increment(twist)


class _DriftingValues(Disturbance):
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
