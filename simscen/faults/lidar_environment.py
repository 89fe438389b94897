"""Effects of surfaces and weather on a lidar: `glass`, `rain`, and `dust`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import clip_to_sensor_range, ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.places import ObjectName
from simscen.spec.quantities import PositiveLength, Probability, Quantity

MM_PER_HOUR = 0.001 / 3600
"""1 mm/h in m/s."""
REFERENCE_REFLECTIVITY = 0.9
"""Lowest reflectivity of a surface that a lidar detects at its maximum range in clear air."""


class Glass(Spec, Fault):
    """Beams pass through the named objects, such as glass doors, and measure the surfaces behind them.

    A real beam is reflected if it is nearly perpendicular to the pane (Foster, Sun, Park and Kuipers, VisAGGE: Visible
    angle grid for glass environments, 2013); this fault ignores the angle. The robot still collides with the objects,
    and its map still shows them.

    Example: `{sensor: lidar, glass: {of: [east wall]}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    of: Annotated[list[ObjectName], Field(min_length=1, max_length=100)]
    """Walls, obstacles, objects, and doors of the world, or objects that an event spawns."""
    probability: Probability = 1.0
    """Probability that a beam passes through the objects."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        """Start to make the named objects transparent."""
        return _TransparentObjects(rng, self, setting)


class _TransparentObjects(FaultEffect):
    """Effect of `glass`."""

    def __init__(self, rng: np.random.Generator, glass: Glass, setting: FaultSetting) -> None:
        self._rng, self._glass, self._simulator = rng, glass, setting.simulator

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan) or self._simulator is None:
            return reading
        passes = self._rng.random(len(reading.ranges)) < self._glass.probability
        opaque = self._simulator.distances(reading)
        transparent = self._simulator.distances(reading, without=self._glass.of)
        ranges = ranges_with_scan_errors(reading, transparent, opaque)
        return replace(reading, ranges=np.where(passes & (transparent != opaque), ranges, reading.ranges))


class Rain(Spec, Fault):
    """Rain weakens the returned light and adds range noise: distant or dark objects disappear (inf).

    At a rain rate of R mm/h, the extinction coefficient is α = 0.01 R^0.6 per meter. A surface with reflectivity ρ at
    range z returns the fraction ρ exp(-2 α z) / z² of the light. The lidar detects the surface if at least as much
    light returns as from a surface with 90 % reflectivity at the lidar's maximum range in clear air. Range errors have
    the standard deviation 0.02 z (1 - exp(-R))². Source: Goodin, Carruth, Doude and Hudson, Predicting the influence of
    rain on lidar in ADAS, Electronics 8 (2019), eq. 3 to 6. For echoes of drops, use `dust`.

    Example: `{sensor: lidar, rain: {rate: 25 mm/h, reflectivity: 50 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    rate: Annotated[float, Field(gt=0, le=500 * MM_PER_HOUR), Quantity("speed")]
    """Rain rate: 2.5 mm/h is light, 10 mm/h moderate, 50 mm/h violent rain."""
    reflectivity: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = REFERENCE_REFLECTIVITY
    """Reflectivity of all surfaces: 90 % is white, 10 % black."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        """Start to attenuate beams and to add range errors."""
        return _RainAttenuation(rng, self)

    @property
    def extinction(self) -> float:
        """Extinction coefficient α, per meter."""
        return float(0.01 * (self.rate / MM_PER_HOUR) ** 0.6)


class _RainAttenuation(FaultEffect):
    """Effect of `rain`."""

    def __init__(self, rng: np.random.Generator, rain: Rain) -> None:
        self._rng, self._rain = rng, rain
        self._relative_std = 0.02 * float((1 - np.exp(-rain.rate / MM_PER_HOUR)) ** 2)

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        ranges = reading.ranges
        errors = self._relative_std * self._rng.standard_normal(len(ranges))
        noisy = np.where(np.isfinite(ranges), np.round(ranges * (1 + errors), 3), ranges)
        with np.errstate(invalid="ignore"):
            is_detected = self._returned_light(ranges) >= REFERENCE_REFLECTIVITY / reading.range_max**2
        return replace(
            reading, ranges=np.where(np.isfinite(ranges) & ~is_detected, np.inf, clip_to_sensor_range(reading, noisy))
        )

    def _returned_light(self, ranges: Array) -> Array:
        """Return the fraction of the light that surfaces at these ranges (n,) return."""
        light: Array = self._rain.reflectivity * np.exp(-2 * self._rain.extinction * ranges) / ranges**2
        return light


class Dust(Spec, Fault):
    """Beams end early at dust, smoke, steam, fog, or snow.

    The distance to the first particle is exponentially distributed with the mean L = `mean_free_path`. A beam to an
    object at range r therefore ends early with probability 1 - exp(-r / L). Source: the short readings of Thrun,
    Burgard and Fox, Probabilistic Robotics, section 6.3, with λ = 1 / L.

    Example: `{sensor: lidar, dust: {mean_free_path: 20 m}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    mean_free_path: PositiveLength
    """Mean distance that a beam travels in free space before it hits a particle."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        """Start to shorten beams at random."""
        return _Particles(rng, self.mean_free_path)


class _Particles(FaultEffect):
    """Effect of `dust`."""

    def __init__(self, rng: np.random.Generator, mean_free_path: float) -> None:
        self._rng, self._mean_free_path = rng, mean_free_path

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        particles = np.round(self._rng.exponential(self._mean_free_path, len(reading.ranges)), 3)
        with np.errstate(invalid="ignore"):
            is_nearer = particles < np.minimum(reading.ranges, reading.range_max)
        return replace(reading, ranges=np.where(is_nearer, clip_to_sensor_range(reading, particles), reading.ranges))
