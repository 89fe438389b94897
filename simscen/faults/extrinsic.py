"""`extrinsic`: the pose of a sensor on the robot differs from its calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Image, Imu, Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import inapplicable_key, ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Length

ANGLES = ("roll", "pitch", "yaw")


class Extrinsic(Spec, Fault):
    """The mounting pose of a sensor is wrong: it was knocked out of place or never calibrated, and no node knows.

    The error is the true pose of the sensor in the frame of its nominal pose. A lidar that is pitched down sees the
    floor as a wall; an IMU that is tilted measures a part of gravity as forward acceleration.

    Example: `{sensor: lidar, extrinsic: {yaw: 3 deg, x: 1 cm}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Image", "Imu"})
    idle: ClassVar[Mapping[str, object]] = dict.fromkeys(("x", "y", "z", *ANGLES), 0.0)
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("x", "y", "z", *ANGLES),
        "Image": ("x", "y", "z", *ANGLES),
        "Imu": ANGLES,
    }
    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    z: Length = 0.0
    """Up."""
    roll: Angle = 0.0
    """Right side down."""
    pitch: Angle = 0.0
    """Front down."""
    yaw: Angle = 0.0
    """Counterclockwise."""

    def unsuitable_key(self, target: Instance) -> tuple[str, str] | None:
        """Reject keys that do not apply to the sensor."""
        return inapplicable_key(self, target)

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Measure from the wrong pose from now on."""
        return _WrongPose(Pose3.from_rpy(self.x, self.y, self.z, self.roll, self.pitch, self.yaw), setting)


class _WrongPose(Disturbance):
    def __init__(self, error: Pose3, setting: FaultSetting) -> None:
        self._error, self._sight = error, setting.sight

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan() if self._sight is not None:
                nominal, actual = self._sight.distances(reading), self._sight.distances(reading, self._error)
                return replace(reading, ranges=ranges_with_scan_errors(reading, actual, nominal))
            case Image() if self._sight is not None:
                image = self._sight.image(self._error)
                return replace(reading, rgb=image.rgb, depth=image.depth)
            case Imu(angular_velocity=angular, linear_acceleration=linear):
                rotated = np.array([angular, linear]) @ self._error.rotation()
                (x, y, z), (a, b, c) = rotated.tolist()
                return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
            case _:
                return reading
