"""`noise`: a lidar gets noisier than it should be."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.sensing import Reading, Scan
from simscen.faults.base import Disturbance, Fault, Wheels
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength


class Noise(Spec, Fault):
    """Gaussian noise is added to every range, on top of the sensor's own; ranges stay within the sensor's limits.

    Example: `{sensor: lidar, noise: {std: 10 cm}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    std: PositiveLength
    """Standard deviation."""

    def begin(self, chance: np.random.Generator, wheels: Wheels) -> Disturbance:
        """Draw once for each beam."""
        return _Noise(chance, self.std)


class _Noise(Disturbance):
    def __init__(self, chance: np.random.Generator, std: float) -> None:
        self._chance, self._std = chance, std

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        noisy = reading.ranges + self._chance.normal(0.0, self._std, len(reading.ranges))
        return replace(
            reading,
            ranges=np.where(np.isfinite(noisy), np.clip(noisy, reading.range_min, reading.range_max), noisy),
        )
