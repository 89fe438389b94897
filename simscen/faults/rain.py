"""`rain`: a lidar in the rain."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.range_readings import clip_to_sensor_range
from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

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
