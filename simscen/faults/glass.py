"""`glass`: a lidar sees through something."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.messages.sensor_data import Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.range_readings import ranges_with_scan_errors
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability
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
