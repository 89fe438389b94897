"""`crosstalk`: false returns caused by another lidar."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.plugin import Angle, AngularSpeed, Fault, FaultEffect, FaultSetting, PositiveAngle, Reading, Scan, Spec


class Crosstalk(Spec, Fault):
    """Another lidar shines into this one: within a window of beams, what is measured is nearer than what is there.

    The window wanders from scan to scan, because the two spin at slightly different rates (Zhang et al. 2018, mutual
    interference of lidars); each echo in it is anywhere between the lidar and what it would have seen.

    Example: `{sensor: lidar, crosstalk: {width: 20 deg, drift: 0.5 rad/s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    width: PositiveAngle = math.radians(15)
    """Of the window."""
    direction: Angle = 0.0
    """Of its middle in the first scan, in the lidar's frame."""
    drift: AngularSpeed = math.radians(30)
    """How fast it wanders, for a lidar with ten scans a second."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        """Begin in the direction that it says."""
        return _Interference(self, rng)


class _Interference(FaultEffect):
    def __init__(self, spec: Crosstalk, rng: np.random.Generator) -> None:
        self._spec, self._rng, self._scans = spec, rng, 0

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        middle = self._spec.direction + self._spec.drift * self._scans / 10
        self._scans += 1
        off = np.remainder(reading.angles() - middle + math.pi, 2 * math.pi) - math.pi
        seen = np.where(np.isfinite(reading.ranges), reading.ranges, reading.range_max)
        echo = self._rng.uniform(reading.range_min, np.maximum(seen, reading.range_min))
        return replace(reading, ranges=np.where(np.abs(off) <= self._spec.width / 2, echo, reading.ranges))
