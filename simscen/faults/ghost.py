"""`ghost`: a lidar sees what is not there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, PositiveAngle, PositiveLength, Probability


class Ghost(Spec, Fault):
    """Beams of a window return something that is not there, nearer than what is: a mirror, a vest, the own cover.

    It keeps its place in the lidar's frame, and so drives along with the robot.

    Example: `{sensor: lidar, ghost: {range: 1 m, direction: 0 deg, width: 10 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    range: PositiveLength
    """Where the ghost is; beams that meet something nearer tell that."""
    direction: Angle = 0.0
    """Of the window's middle in the lidar's frame."""
    width: PositiveAngle = 0.17453292519943295
    """Of the window."""
    probability: Probability = 1.0
    """The chance that a beam of the window sees it, anew for each scan."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A ghost that the lidar cannot see."""
        least, most = (getattr(instance.spec, key, None) for key in ("min_range", "max_range"))
        if least is None or most is None or least <= self.range <= most:
            return None
        return "range", f"the sensor measures from {least:g} m to {most:g} m"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw for each beam of the window."""
        return _Haunted(chance, self)


class _Haunted(Disturbance):
    def __init__(self, chance: np.random.Generator, ghost: Ghost) -> None:
        self._chance, self._ghost = chance, ghost

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        ghost = self._ghost
        off = np.remainder(reading.angles() - ghost.direction + math.pi, 2 * math.pi) - math.pi
        seen = (np.abs(off) <= ghost.width / 2) & (self._chance.random(len(off)) < ghost.probability)
        nearer = np.fmin(reading.ranges, ghost.range)
        return replace(reading, ranges=np.where(seen, nearer, reading.ranges))
