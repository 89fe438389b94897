"""Effects of surfaces and weather on a lidar: `glass`, `rain`, and `dust`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import clip_to_sensor_range, ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength, Probability, Quantity
from simscen.spec.references import ObjectName


class Glass(Spec, Fault):
    """Beams go through what is named, and return what lies behind it: glass doors and walls, polished steel, water.

    A laser passes a pane but for a few degrees about its normal (Foster, Sun, Park and Kuipers, VisAGGE: Visible angle
    grid for glass environments, 2013); `probability` is the share of beams that do. The robot collides with it all the
    same, and its map shows it.

    Example: `{sensor: lidar, glass: {of: [east wall]}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    of: Annotated[list[ObjectName], Field(min_length=1, max_length=100)]
    """Walls, obstacles, objects and doors of the world, or what an event spawns."""
    probability: Probability = 1.0
    """The chance that a beam goes through."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Cast each scan once more, without what is glass."""
        return _Panes(chance, self, setting)


class _Panes(Disturbance):
    def __init__(self, chance: np.random.Generator, glass: Glass, setting: FaultSetting) -> None:
        self._chance, self._glass, self._sight = chance, glass, setting.sight

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan) or self._sight is None:
            return reading
        through = self._chance.random(len(reading.ranges)) < self._glass.probability
        there = self._sight.distances(reading)
        behind = self._sight.distances(reading, without=self._glass.of)
        told = ranges_with_scan_errors(reading, behind, there)
        return replace(reading, ranges=np.where(through & (behind != there), told, reading.ranges))


MM_PER_HOUR = 0.001 / 3600
REFERENCE = 0.9
"""Reflectivity of what a lidar just sees at its largest range in clear air."""
RainRate = Annotated[float, Field(gt=0, le=500 * MM_PER_HOUR), Quantity("speed")]


class Rain(Spec, Fault):
    """Rain weakens what comes back and makes ranges uncertain: what is far or dark is not seen any more (inf).

    Of a rate R in mm/h the extinction is α = 0.01 R^0.6 per meter. From a range z comes back ρ exp(-2 α z) / z²;
    nothing is seen where that is less than 90 % of the light would be from the lidar's largest range in clear air.
    Ranges get an error with the standard deviation 0.02 z (1 - exp(-R))². Goodin, Carruth, Doude and Hudson, Predicting
    the influence of rain on lidar in ADAS, Electronics 8 (2019), eq. 3 to 6. Drops that echo themselves are `dust`.

    Example: `{sensor: lidar, rain: {rate: 25 mm/h, reflectivity: 50 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    rate: RainRate
    """How much falls: 2.5 mm/h is light, 10 mm/h moderate, 50 mm/h violent rain."""
    reflectivity: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = REFERENCE
    """Of all that is around: 90 % is white, 10 % black."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw an error for each beam."""
        return _Wet(chance, self)

    @property
    def extinction(self) -> float:
        """α, per meter."""
        return float(0.01 * (self.rate / MM_PER_HOUR) ** 0.6)


class _Wet(Disturbance):
    def __init__(self, chance: np.random.Generator, rain: Rain) -> None:
        self._chance, self._rain = chance, rain
        self._spread = 0.02 * float((1 - np.exp(-rain.rate / MM_PER_HOUR)) ** 2)

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        ranges = reading.ranges
        errors = self._spread * self._chance.standard_normal(len(ranges))
        told = np.where(np.isfinite(ranges), np.round(ranges * (1 + errors), 3), ranges)
        with np.errstate(invalid="ignore"):
            seen = self._returned(ranges) >= REFERENCE / reading.range_max**2
        return replace(
            reading, ranges=np.where(np.isfinite(ranges) & ~seen, np.inf, clip_to_sensor_range(reading, told))
        )

    def _returned(self, ranges: Array) -> Array:
        returned: Array = self._rain.reflectivity * np.exp(-2 * self._rain.extinction * ranges) / ranges**2
        return returned


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
