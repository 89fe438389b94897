"""`extrinsic`: a sensor does not sit where everybody thinks it does."""

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
    """A sensor is knocked out of its place, or was never calibrated: it measures from elsewhere, and nobody is told.

    The error is where it really is in the frame in which it is thought to be. A lidar that is pitched down sees the
    floor as a wall; an inertial unit that is tilted feels gravity ahead.

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
    """Anticlockwise."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Keys that mean nothing there."""
        return inapplicable_key(self, instance)

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From now on it measures from there."""
        return _Knocked(Pose3.from_rpy(self.x, self.y, self.z, self.roll, self.pitch, self.yaw), setting)


class _Knocked(Disturbance):
    def __init__(self, error: Pose3, setting: FaultSetting) -> None:
        self._error, self._sight = error, setting.sight

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan() if self._sight is not None:
                there, elsewhere = self._sight.distances(reading), self._sight.distances(reading, self._error)
                return replace(reading, ranges=ranges_with_scan_errors(reading, elsewhere, there))
            case Image() if self._sight is not None:
                seen = self._sight.image(self._error)
                return replace(reading, rgb=seen.rgb, depth=seen.depth)
            case Imu(angular_velocity=turning, linear_acceleration=pushing):
                turned = np.array([turning, pushing]) @ self._error.rotation()
                (x, y, z), (a, b, c) = turned.tolist()
                return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
            case _:
                return reading
