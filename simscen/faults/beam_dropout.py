"""`beam_dropout`: single lidar beams give no answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability


class BeamDropout(Spec, Fault):
    """Each beam of each scan gives no answer (nan) with a probability, as over dark or wet surfaces.

    Example: `{sensor: lidar, beam_dropout: {probability: 40 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """The chance that a beam gives no answer."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw once for each beam."""
        return _Holes(chance, self.probability)


class _Holes(Disturbance):
    def __init__(self, chance: np.random.Generator, probability: float) -> None:
        self._chance, self._probability = chance, probability

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        lost = self._chance.random(len(reading.ranges)) < self._probability
        return replace(reading, ranges=np.where(lost, np.nan, reading.ranges))
