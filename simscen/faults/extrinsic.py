"""The fault `extrinsic`: a sensor whose mounting pose is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Image, Imu, Reading, Scan
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import ChangedReadings, ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Length

ROTATION_KEYS = ("roll", "pitch", "yaw")
"""Keys of the rotation. The position of an IMU is ignored."""


class Extrinsic(Spec, Fault):
    """The mounting pose of a sensor is wrong: the sensor was knocked out of place or never calibrated.

    The keys are the true pose of the sensor in the frame of its nominal pose. The stack assumes the nominal pose. A
    lidar that is pitched down sees the floor as a wall. A tilted IMU measures a part of gravity as acceleration.

    Example: `{sensor: lidar, extrinsic: {yaw: 3 deg, x: 1 cm}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Image", "Imu"})
    measures_again: ClassVar[bool] = True
    neutral_values: ClassVar[Mapping[str, object]] = dict.fromkeys(("x", "y", "z", *ROTATION_KEYS), 0.0)
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Scan": ("x", "y", "z", *ROTATION_KEYS),
        "Image": ("x", "y", "z", *ROTATION_KEYS),
        "Imu": ROTATION_KEYS,
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

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        error = Pose3.from_rpy(self.x, self.y, self.z, self.roll, self.pitch, self.yaw)
        simulator = setting.simulator

        def measure_again(reading: Reading) -> Reading:
            match reading:
                case Scan() if simulator is not None:
                    nominal, displaced = simulator.distances(reading), simulator.distances(reading, error)
                    return replace(reading, ranges=ranges_with_scan_errors(reading, displaced, nominal))
                case Image() if simulator is not None:
                    image = simulator.image(error)
                    return replace(reading, rgb=image.rgb, depth=image.depth)
                case Imu(angular_velocity=angular, linear_acceleration=linear):
                    with np.errstate(invalid="ignore"):  # garbage from another fault
                        (x, y, z), (a, b, c) = (np.array([angular, linear]) @ error.rotation()).tolist()
                    return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
                case _:
                    return reading

        return ChangedReadings(measure_again)
