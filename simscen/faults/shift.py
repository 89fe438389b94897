"""`shift`: the map lies where it should not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Length


class Shift(Spec, Fault):
    """The map that the stack gets is shifted and turned: a wrong origin in its YAML file, another survey's frame.

    Goals and the initial estimate stay where they are. The whole is turned about the map frame's origin, then shifted.

    Example: `{sensor: map, shift: {x: 20 cm, yaw: 1 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Map"})
    idle: ClassVar[Mapping[str, object]] = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    x: Length = 0.0
    """Along the map's x."""
    y: Length = 0.0
    """Along the map's y."""
    yaw: Angle = 0.0
    """Anticlockwise."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Before the stack gets it."""
        return _Moved(Pose2(self.x, self.y, self.yaw))


class _Moved(Disturbance):
    def __init__(self, by: Pose2) -> None:
        self._by = by

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        return replace(grid, origin=self._by.compose(grid.origin))
