"""`scale`: a sensor measures with a wrong yardstick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Imu, Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import OdometryDistortion
from simscen.faults.range_readings import with_distances
from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

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
        return _ScaledSteps(self.factor) if setting.kind == "Odometry" else _Scaled(self.factor)


class _ScaledSteps(OdometryDistortion):
    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor

    def increment(self, step: Twist) -> Twist:
        return Twist(*(self._factor * value for value in step))


class _Scaled(Disturbance):
    def __init__(self, factor: float) -> None:
        self._factor = factor

    def reading(self, reading: Reading) -> Reading | None:
        if isinstance(reading, Imu):
            x, y, z = (self._factor * value for value in reading.angular_velocity)
            a, b, c = (self._factor * value for value in reading.linear_acceleration)
            return replace(reading, angular_velocity=(x, y, z), linear_acceleration=(a, b, c))
        return with_distances(reading, lambda distances: distances * self._factor)
