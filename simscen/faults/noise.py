"""`noise`: a sensor gets noisier than it should be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Imu, Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import OdometryDistortion, inapplicable_key
from simscen.spec.base import Spec
from simscen.spec.quantities import (
    NonNegativeAcceleration,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    Probability,
)


class Noise(Spec, Fault):
    """Gaussian noise is added, on top of the sensor's own: a failing or ill-shielded sensor, vibration, bad light.

    On a lidar and on a camera's depths `std` is added to every range, which stays within the sensor's limits; `colour`
    to every pixel. On odometry `linear` and `angular` grow with the square root of the way, so that they do not depend
    on the rate. On the localizer every belief is off by another draw.

    Example: `{sensor: lidar, noise: {std: 10 cm}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image", "Belief"})
    idle: ClassVar[Mapping[str, object]] = dict.fromkeys(
        ("std", "colour", "linear", "angular", "gyro", "accelerometer"), 0.0
    )
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("std",),
        "Image": ("std", "colour"),
        "Odometry": ("linear", "angular"),
        "Imu": ("gyro", "accelerometer"),
        "Belief": ("linear", "angular"),
    }
    std: NonNegativeLength = 0.0
    """Standard deviation of a range or depth."""
    colour: Probability = 0.0
    """Standard deviation of a pixel's red, green and blue, of their full scale."""
    linear: NonNegativeLength = 0.0
    """Standard deviation of odometry's distance after one meter; of a belief, in x and in y."""
    angular: NonNegativeAngle = 0.0
    """Standard deviation of odometry's heading after one radian turned; of a belief's heading."""
    gyro: NonNegativeAngularSpeed = 0.0
    """Standard deviation of each turn rate."""
    accelerometer: NonNegativeAcceleration = 0.0
    """Standard deviation of each acceleration."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Keys that mean nothing there."""
        return inapplicable_key(self, instance)

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw anew for each message."""
        return _NoisyOdometry(chance, self, setting) if setting.kind == "Odometry" else _Noise(chance, self)


class _Noise(Disturbance):
    def __init__(self, chance: np.random.Generator, noise: Noise) -> None:
        self._chance, self._noise = chance, noise

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan(ranges=ranges):
                noisy = ranges + self._chance.normal(0.0, self._noise.std, len(ranges))
                within = np.clip(noisy, reading.range_min, reading.range_max)
                return replace(reading, ranges=np.where(np.isfinite(noisy), within, noisy))
            case Image(rgb=rgb, depth=depth):
                colors = rgb + self._chance.normal(0.0, 255 * self._noise.colour, rgb.shape)
                depths = depth + self._chance.normal(0.0, self._noise.std, depth.shape)
                seen = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
                return replace(reading, rgb=seen, depth=np.maximum(depths, 0.0).astype(np.float32))
            case Imu(angular_velocity=turning, linear_acceleration=pushing):
                draws = self._chance.standard_normal((2, 3))
                x, y, z = (np.array(turning) + self._noise.gyro * draws[0]).tolist()
                a, b, c = (np.array(pushing) + self._noise.accelerometer * draws[1]).tolist()
                return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
            case _:
                return reading

    def belief(self, belief: Belief) -> Belief:
        x, y, turn = self._chance.standard_normal(3).tolist()
        spread = self._noise.linear
        pose = belief.pose
        off = Pose2(pose.x + spread * x, pose.y + spread * y, pose.yaw + self._noise.angular * turn)
        odometry = belief.map_from_odom.between(pose)
        return replace(belief, pose=off, map_from_odom=off.compose(odometry.inverse()))


class _NoisyOdometry(OdometryDistortion):
    def __init__(self, chance: np.random.Generator, noise: Noise, setting: FaultSetting) -> None:
        super().__init__()
        self._chance, self._noise, self._clock = chance, noise, setting.clock

    def increment(self, step: Twist) -> Twist:
        driven, turned = math.hypot(step.vx, step.vy), abs(step.wz)
        along, turn = self._chance.standard_normal(2).tolist()
        return Twist(
            step.vx + self._noise.linear * math.sqrt(driven) * along,
            step.vy,
            step.wz + self._noise.angular * math.sqrt(turned) * turn,
        )

    def reported(self, step: Twist, twist: Twist, ticks: int) -> tuple[Twist, Twist]:
        noisy = self.increment(step)
        if not ticks:
            return noisy, twist
        seconds = self._clock.seconds(ticks)
        along, turn = (noisy.vx - step.vx) / seconds, (noisy.wz - step.wz) / seconds
        return noisy, Twist(twist.vx + along, twist.vy, twist.wz + turn)
