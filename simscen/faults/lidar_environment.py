"""Effects of surfaces and weather on a lidar: `glass`, `rain`, and `dust`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Scan
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import ChangedRanges, clip_to_sensor_range, ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.places import ObjectName
from simscen.spec.quantities import PositiveLength, Probability, Quantity

MM_PER_HOUR = 0.001 / 3600
"""One millimeter per hour in m/s."""
REFERENCE_REFLECTIVITY = 0.9
"""Minimum reflectivity of a surface that a lidar detects at its maximum range in clear air."""


class Glass(Spec, Fault):
    """Beams pass through the named objects, such as glass doors, and measure the surfaces behind the objects.

    A real beam is reflected if it is nearly perpendicular to the pane (Foster, Sun, Park and Kuipers, VisAGGE: Visible
    angle grid for glass environments, 2013). This fault ignores the angle. The robot still collides with the objects,
    and the map still shows the objects.

    Example: `{sensor: lidar, glass: {of: [east wall]}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    measures_again: ClassVar[bool] = True
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    of: Annotated[list[ObjectName], Field(min_length=1, max_length=100)]
    """Walls, obstacles, objects, and doors of the world, or objects that an event spawns."""
    probability: Probability = 1.0
    """Probability that a beam passes through the objects."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        simulator = setting.simulator
        assert simulator is not None  # a lidar has one

        def ranges(scan: Scan) -> Array:
            passes_glass = rng.random(len(scan.ranges)) < self.probability
            to_glass, behind_glass = simulator.distances(scan), simulator.distances(scan, without=self.of)
            changed = ranges_with_scan_errors(scan, behind_glass, to_glass)
            return np.where(passes_glass & (behind_glass != to_glass), changed, scan.ranges)

        return ChangedRanges(ranges)


class Rain(Spec, Fault):
    """Rain weakens the returned light and adds range noise: distant or dark objects disappear (inf).

    At a rain rate of R mm/h, the extinction coefficient is α = 0.01 R^0.6 per meter. A surface with reflectivity ρ at
    range z returns light proportional to ρ exp(-2 α z) / z². The lidar detects the surface if at least as much light
    returns as from a surface with 90 % reflectivity at the lidar's maximum range in clear air. Range errors have the
    standard deviation 0.02 z (1 - exp(-R))². Source: Goodin, Carruth, Doude and Hudson, Predicting the influence of
    rain on lidar in ADAS, Electronics 8 (2019), eq. 3 to 6. To simulate echoes of raindrops, use `dust`.

    Example: `{sensor: lidar, rain: {rate: 25 mm/h, reflectivity: 50 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    rate: Annotated[float, Field(gt=0, le=500 * MM_PER_HOUR), Quantity("speed")]
    """Rain rate: 2.5 mm/h is light, 10 mm/h moderate, 50 mm/h violent rain."""
    reflectivity: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = REFERENCE_REFLECTIVITY
    """Reflectivity of all surfaces: 90 % is white, 10 % black."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        relative_std = 0.02 * float((1 - np.exp(-self.rate / MM_PER_HOUR)) ** 2)
        extinction = float(0.01 * (self.rate / MM_PER_HOUR) ** 0.6)

        def ranges(scan: Scan) -> Array:
            errors = relative_std * rng.standard_normal(len(scan.ranges))
            is_finite = np.isfinite(scan.ranges)
            noisy = np.where(is_finite, np.round(scan.ranges * (1 + errors), 3), scan.ranges)
            with np.errstate(invalid="ignore", divide="ignore"):
                returned_light = self.reflectivity * np.exp(-2 * extinction * scan.ranges) / scan.ranges**2
                is_detected = returned_light >= REFERENCE_REFLECTIVITY / scan.range_max**2
            return np.where(is_finite & ~is_detected, np.inf, clip_to_sensor_range(scan, noisy))

        return ChangedRanges(ranges)


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
        def ranges(scan: Scan) -> Array:
            to_particle = np.round(rng.exponential(self.mean_free_path, len(scan.ranges)), 3)
            with np.errstate(invalid="ignore"):
                is_nearer = to_particle < np.minimum(scan.ranges, scan.range_max)
            return np.where(is_nearer, clip_to_sensor_range(scan, to_particle), scan.ranges)

        return ChangedRanges(ranges)
