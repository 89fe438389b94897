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
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import ChangedReadings, OdometryDistortion, apply_pose_error, change_distances
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
    """A constant error: wrong wheel radii, a gyroscope that was not calibrated, a lidar that is too warm.

    To multiply all values of a sensor by one factor, use `scale`.

    Example: `{sensor: odom, bias: {linear_scale: 1.1, turn_per_metre: 0.05}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Odometry", "Scan", "Imu", "Image"})
    neutral_values: ClassVar[Mapping[str, object]] = {
        **dict.fromkeys(("linear_scale", "angular_scale"), 1.0),
        **dict.fromkeys(("turn_per_metre", "range", "gyro", "accelerometer", "brightness"), 0.0),
    }
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Odometry": ("linear_scale", "angular_scale", "turn_per_metre"),
        "Scan": ("range",),
        "Imu": ("gyro", "accelerometer"),
        "Image": ("range", "brightness"),
    }
    linear_scale: Ratio = 1.0
    """Ratio of reported to driven distance, for example 1.05 if the wheels are worn to 95 % of their radius."""
    angular_scale: Ratio = 1.0
    """Ratio of reported to true turn."""
    turn_per_metre: Angle = 0.0
    """Additional turn that the odometry reports for each meter driven forward, as with unequal wheel radii."""
    range: Length = 0.0
    """Added to each range or depth."""
    gyro: AngularSpeed = 0.0
    """Added to the angular velocity about the z axis of the IMU."""
    accelerometer: Acceleration = 0.0
    """Added to the acceleration along the x axis of the IMU."""
    brightness: Annotated[float, Field(ge=-1, le=1), Quantity("ratio")] = 0.0
    """Added to red, green, and blue of each pixel; 1 is the full scale."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        if setting.kind == "Odometry":
            return OdometryDistortion(lambda step, velocity, _: (self._distort(step), self._distort(velocity)))
        return ChangedReadings(self._add_bias)

    def _distort(self, twist: Twist) -> Twist:
        turn = twist.wz * self.angular_scale + twist.vx * self.turn_per_metre
        return Twist(twist.vx * self.linear_scale, twist.vy * self.linear_scale, turn)

    def _add_bias(self, reading: Reading) -> Reading:
        if isinstance(reading, Imu):
            x, y, z = reading.angular_velocity
            a, b, c = reading.linear_acceleration
            return replace(
                reading, angular_velocity=(x, y, z + self.gyro), linear_acceleration=(a + self.accelerometer, b, c)
            )
        changed = change_distances(reading, lambda distances: distances + self.range)
        if isinstance(changed, Image) and self.brightness:
            return replace(changed, rgb=np.clip(np.rint(changed.rgb + 255 * self.brightness), 0, 255).astype(np.uint8))
        return changed


class Scale(Spec, Fault):
    """All values of a sensor are too large or too small by a factor. Of a camera, only the depths change.

    Possible causes are a lidar clock that runs fast or slow, low tire pressure (odometry), and a wrong full-scale
    setting of an IMU. The acceleration of an IMU is scaled including gravity.

    Example: `{sensor: odom, scale: {factor: 105 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image"})
    neutral_values: ClassVar[Mapping[str, object]] = {"factor": 1.0}
    factor: Annotated[float, Field(gt=0, le=100), Quantity("ratio")]
    """Ratio of reported to true value."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        if setting.kind == "Odometry":
            return OdometryDistortion(lambda step, velocity, _: (self._distort(step), self._distort(velocity)))
        return ChangedReadings(self._scale_reading)

    def _distort(self, twist: Twist) -> Twist:
        return Twist(*(self.factor * value for value in twist))

    def _scale_reading(self, reading: Reading) -> Reading:
        if isinstance(reading, Imu):
            x, y, z = (self.factor * value for value in reading.angular_velocity)
            a, b, c = (self.factor * value for value in reading.linear_acceleration)
            return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
        return change_distances(reading, lambda distances: distances * self.factor)


class Drift(Spec, Fault):
    """An error that starts at zero and grows with time: electronics that warm up, a drifting gyroscope bias.

    Odometry reports motion while the robot stands still. On the localizer, the estimated pose drifts in the direction
    of its heading when the fault started, as with a scan matcher in a corridor without features.

    Example: `{sensor: imu, drift: {gyro: 0.01 rad/s^2}, when: {time: 2 s}, for: 10 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image", "Belief"})
    neutral_values: ClassVar[Mapping[str, object]] = dict.fromkeys(("range", "linear", "angular", "gyro"), 0.0)
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("range",),
        "Image": ("range",),
        "Odometry": ("linear", "angular"),
        "Imu": ("gyro",),
        "Belief": ("linear", "angular"),
    }
    range: Speed = 0.0
    """Growth rate of the error of each range or depth."""
    linear: Speed = 0.0
    """Forward velocity error of the odometry or of the estimated pose."""
    angular: AngularSpeed = 0.0
    """Angular velocity error of the odometry or of the estimated pose."""
    gyro: AngularAcceleration = 0.0
    """Growth rate of the error of the angular velocity about the z axis of the IMU."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        if setting.kind != "Odometry":
            return _DriftingValues(self, setting)

        def add_drift(step: Twist, velocity: Twist, ticks: int) -> tuple[Twist, Twist]:
            seconds = setting.clock.seconds(ticks)
            return (
                Twist(step.vx + self.linear * seconds, step.vy, step.wz + self.angular * seconds),
                Twist(velocity.vx + self.linear, velocity.vy, velocity.wz + self.angular),
            )

        return OdometryDistortion(add_drift)


class _DriftingValues(FaultEffect):
    """Effect of `drift` on a lidar, IMU, camera, or the localizer."""

    def __init__(self, drift: Drift, setting: FaultSetting) -> None:
        self._drift, self._setting, self._start_tick = drift, setting, setting.now()
        self._start_pose: Pose2 | None = None

    def _seconds_until(self, tick: int) -> float:
        """Return the time in s from the start of the fault to `tick`; 0 if `tick` is earlier."""
        return self._setting.clock.seconds(max(0, tick - self._start_tick))

    def reading(self, reading: Reading) -> Reading | None:
        elapsed = self._seconds_until(reading.tick)
        if isinstance(reading, Imu):
            x, y, z = reading.angular_velocity
            return replace(reading, angular_velocity=(x, y, z + self._drift.gyro * elapsed))
        return change_distances(reading, lambda distances: distances + self._drift.range * elapsed)

    def belief(self, belief: Belief) -> Belief:
        elapsed = self._seconds_until(self._setting.now())
        if self._start_pose is None:
            self._start_pose = belief.pose
        drift = Pose2(self._drift.linear * elapsed, 0.0, self._drift.angular * elapsed)
        error = self._start_pose.compose(drift).compose(self._start_pose.inverse())
        return apply_pose_error(belief, error)
