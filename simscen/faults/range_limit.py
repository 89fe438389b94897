"""`range_limit`: a sensor sees less far."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.messages.sensor_data import Image, Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength


class RangeLimit(Spec, Fault):
    """What is farther away than this returns nothing (inf), as if nothing were there: dark surfaces, a weak laser.

    Example: `{sensor: lidar, range_limit: {max: 3 m}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Image"})
    max: PositiveLength
    """The largest range or depth that is still measured."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A limit beyond the sensor's own."""
        own = getattr(instance.spec, "max_range", None)
        if own is None or self.max < own:
            return None
        return "max", f"{self.max:g} m limits nothing: the sensor's own range is {own:g} m"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From now on."""
        return _Short(self.max)


class _Short(Disturbance):
    def __init__(self, most: float) -> None:
        self._most = most

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan(ranges=ranges):
                with np.errstate(invalid="ignore"):
                    return replace(reading, ranges=np.where(ranges > self._most, np.inf, ranges))
            case Image(depth=depth):
                return replace(reading, depth=np.where(depth > self._most, np.float32(np.inf), depth))
            case _:
                return reading
