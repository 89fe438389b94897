"""`dropout`: messages get lost."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.sensing import Reading
from simscen.faults.base import Disturbance, Fault, Wheels
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability


class Dropout(Spec, Fault):
    """Each message is lost with a probability, independently of the others.

    Example: `{sensor: lidar, dropout: {probability: 30 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image"})
    probability: Probability
    """The chance that a message is lost."""

    def begin(self, chance: np.random.Generator, wheels: Wheels) -> Disturbance:
        """Draw once for each message."""
        return _Loss(chance, self.probability)


class _Loss(Disturbance):
    def __init__(self, chance: np.random.Generator, probability: float) -> None:
        self._chance, self._probability = chance, probability

    def reading(self, reading: Reading) -> Reading | None:
        return None if self._chance.random() < self._probability else reading
