"""`bias`: a sensor is off, steadily."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Image, Imu, Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import OdometryDistortion, inapplicable_key
from simscen.faults.range_readings import with_distances
from simscen.spec.base import Spec
from simscen.spec.quantities import Acceleration, Angle, AngularSpeed, Length, Quantity, Ratio


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
        return _Off(self) if setting.kind in ("Scan", "Imu", "Image") else _Scaled(self)


class _Scaled(OdometryDistortion):
    def __init__(self, bias: Bias) -> None:
        super().__init__()
        self._bias = bias

    def increment(self, step: Twist) -> Twist:
        turn = step.wz * self._bias.angular_scale + step.vx * self._bias.turn_per_metre
        return Twist(step.vx * self._bias.linear_scale, step.vy * self._bias.linear_scale, turn)


class _Off(Disturbance):
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
