"""The fault `noise`: additional Gaussian noise on a sensor or on the localizer."""

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
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import OdometryDistortion
from simscen.spec.base import Spec
from simscen.spec.quantities import (
    NonNegativeAcceleration,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    Probability,
)


class Noise(Spec, Fault):
    """Additional Gaussian noise: a failing or badly shielded sensor, vibration, poor light.

    Noisy ranges stay within the range limits of the lidar. Odometry errors grow with the square root of the driven
    distance and turn, and therefore do not depend on the message rate. On the localizer, each estimated pose has an
    independent error.

    Example: `{sensor: lidar, noise: {std: 10 cm}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image", "Belief"})
    neutral_values: ClassVar[Mapping[str, object]] = dict.fromkeys(
        ("std", "colour", "linear", "angular", "gyro", "accelerometer"), 0.0
    )
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("std",),
        "Image": ("std", "colour"),
        "Odometry": ("linear", "angular"),
        "Imu": ("gyro", "accelerometer"),
        "Belief": ("linear", "angular"),
    }
    std: NonNegativeLength = 0.0
    """Standard deviation of each range or depth."""
    colour: Probability = 0.0
    """Standard deviation of red, green, and blue of each pixel; 1 is the full scale."""
    linear: NonNegativeLength = 0.0
    """Odometry: standard deviation of the distance after one meter. Localizer: standard deviation of x and of y."""
    angular: NonNegativeAngle = 0.0
    """Odometry: standard deviation of the heading after a turn of one radian. Localizer: of each estimated heading."""
    gyro: NonNegativeAngularSpeed = 0.0
    """Standard deviation of the angular velocity about each axis."""
    accelerometer: NonNegativeAcceleration = 0.0
    """Standard deviation of the acceleration along each axis."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        if setting.kind != "Odometry":
            return _NoisyValues(rng, self)

        def add_noise(step: Twist, velocity: Twist, ticks: int) -> tuple[Twist, Twist]:
            forward_draw, turn_draw = rng.standard_normal(2).tolist()
            forward = step.vx + self.linear * math.sqrt(math.hypot(step.vx, step.vy)) * forward_draw
            turn = step.wz + self.angular * math.sqrt(abs(step.wz)) * turn_draw
            if ticks:
                seconds = setting.clock.seconds(ticks)
                vx, wz = velocity.vx + (forward - step.vx) / seconds, velocity.wz + (turn - step.wz) / seconds
                velocity = Twist(vx, velocity.vy, wz)
            return Twist(forward, step.vy, turn), velocity

        return OdometryDistortion(add_noise)


class _NoisyValues(FaultEffect):
    """Effect of `noise` on a lidar, camera, IMU, or the localizer."""

    def __init__(self, rng: np.random.Generator, noise: Noise) -> None:
        self._rng, self._noise = rng, noise

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan(ranges=ranges):
                noisy = ranges + self._rng.normal(0.0, self._noise.std, len(ranges))
                limited = np.clip(noisy, reading.range_min, reading.range_max)
                return replace(reading, ranges=np.where(np.isfinite(noisy), limited, noisy))
            case Image(rgb=rgb, depth=depth):
                colors = rgb + self._rng.normal(0.0, 255 * self._noise.colour, rgb.shape)
                depths = depth + self._rng.normal(0.0, self._noise.std, depth.shape)
                rgb = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
                return replace(reading, rgb=rgb, depth=np.maximum(depths, 0.0).astype(np.float32))
            case Imu(angular_velocity=angular, linear_acceleration=linear):
                draws = self._rng.standard_normal((2, 3))
                x, y, z = (np.array(angular) + self._noise.gyro * draws[0]).tolist()
                a, b, c = (np.array(linear) + self._noise.accelerometer * draws[1]).tolist()
                return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
            case _:
                return reading

    def belief(self, belief: Belief) -> Belief:
        x_draw, y_draw, yaw_draw = self._rng.standard_normal(3).tolist()
        std = self._noise.linear
        pose = belief.pose
        noisy = Pose2(pose.x + std * x_draw, pose.y + std * y_draw, pose.yaw + self._noise.angular * yaw_draw)
        odometry = belief.map_from_odom.between(pose)
        return replace(belief, pose=noisy, map_from_odom=noisy.compose(odometry.inverse()))
