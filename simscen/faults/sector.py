"""`sector`: a lidar is blind in some directions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle


class Sector(Spec, Fault):
    """Beams of some directions give no answer (nan): dirt on the cover, a cable or a load in front of it, a mask.

    Example: `{sensor: lidar, sector: {from: -30 deg, to: 30 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    from_: Angle = Field(alias="from")
    """The first blind direction in the lidar's frame (0 = where it looks)."""
    to: Angle
    """The last one, going anticlockwise."""

    @property
    def width(self) -> float:
        """Radians from the first to the last, anticlockwise; a whole turn for a whole turn."""
        turn = 2 * math.pi
        return turn if self.to - self.from_ >= turn - 1e-9 else (self.to - self.from_) % turn

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A sector of no width."""
        return ("to", "the sector ends where it begins") if not self.width else None

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """The same beams of each scan."""
        return _Blind(self.from_, self.width)


class _Blind(Disturbance):
    def __init__(self, first: float, width: float) -> None:
        self._first, self._width = first, width

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        after = np.remainder(reading.angles() - self._first + 1e-9, 2 * math.pi)
        return replace(reading, ranges=np.where(after <= self._width + 2e-9, np.nan, reading.ranges))
