"""`dust`: beams end at particles in the air."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.range_readings import clip_to_sensor_range
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength


class Dust(Spec, Fault):
    """Beams end early at dust, smoke, steam, fog or snow.

    Particles lie along a beam as in a Poisson process, so the first is at an exponential distance with the mean
    `mean_free_path` L: a beam to something at range r ends early with the probability 1 - exp(-r / L). These are the
    short readings of Thrun, Burgard and Fox, Probabilistic Robotics, section 6.3 (their λ = 1 / L).

    Example: `{sensor: lidar, dust: {mean_free_path: 20 m}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    mean_free_path: PositiveLength
    """How far a beam comes on average where nothing else is in its way."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw for each beam of each scan."""
        return _Cloud(chance, self.mean_free_path)


class _Cloud(Disturbance):
    def __init__(self, chance: np.random.Generator, path: float) -> None:
        self._chance, self._path = chance, path

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        particles = np.round(self._chance.exponential(self._path, len(reading.ranges)), 3)
        with np.errstate(invalid="ignore"):
            before = particles < np.minimum(reading.ranges, reading.range_max)
        return replace(reading, ranges=np.where(before, clip_to_sensor_range(reading, particles), reading.ranges))
