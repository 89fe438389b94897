"""`dropout`: messages get lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability


class Dropout(Spec, Fault):
    """Each message is lost with a probability, independently of the others, as over a bad radio link.

    A base that hears no command keeps the last one, and stops after its `command_timeout`.

    Example: `{sensor: lidar, dropout: {probability: 30 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """The chance that a message is lost."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw once for each message."""
        return _Loss(chance, self.probability)


class _Loss(Disturbance):
    def __init__(self, chance: np.random.Generator, probability: float) -> None:
        self._chance, self._probability = chance, probability

    def _lost(self) -> bool:
        return bool(self._chance.random() < self._probability)

    def reading(self, reading: Reading) -> Reading | None:
        return None if self._lost() else reading

    def command(self, command: Twist) -> Twist | None:
        return None if self._lost() else command
