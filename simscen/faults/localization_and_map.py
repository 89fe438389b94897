"""Faults of the localizer and of the map: `jump`, `shift`, and `outdated`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.messages.navigation import Belief
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import apply_pose_error
from simscen.spec.base import Spec
from simscen.spec.places import Ring
from simscen.spec.quantities import Angle, Length

Rings = Annotated[list[Ring], Field(max_length=100)]
"""Polygons in the map frame."""


class Jump(Spec, Fault):
    """The estimated pose jumps, as when a localizer mistakes one aisle for another.

    The keys are the displacement in the frame of the estimated pose at the start of the fault. The estimated pose keeps
    this error until the fault ends, and then jumps back. The fault does not disturb the localizer itself.

    Example: `{sensor: localizer, jump: {x: 1 m, yaw: 10 deg}, when: {time: 5 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Belief"})
    neutral_values: ClassVar[Mapping[str, object]] = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    yaw: Angle = 0.0
    """Counterclockwise."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _ShiftedBelief(Pose2(self.x, self.y, self.yaw))


class _ShiftedBelief(FaultEffect):
    """Effect of `jump`."""

    def __init__(self, jump: Pose2) -> None:
        self._jump = jump
        self._error: Pose2 | None = None

    def belief(self, belief: Belief) -> Belief:
        if self._error is None:
            self._error = belief.pose.compose(self._jump).compose(belief.pose.inverse())
        return apply_pose_error(belief, self._error)


class Shift(Spec, Fault):
    """The map of the stack is rotated and shifted: a wrong origin in its YAML file, or a map from another survey.

    Goals and the initial pose do not change. The map is first rotated about the origin of the map frame, then shifted.

    Example: `{sensor: map, shift: {x: 20 cm, yaw: 1 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Map"})
    neutral_values: ClassVar[Mapping[str, object]] = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    x: Length = 0.0
    """Along the x axis of the map."""
    y: Length = 0.0
    """Along the y axis of the map."""
    yaw: Angle = 0.0
    """Counterclockwise."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        shift = Pose2(self.x, self.y, self.yaw)
        return _ChangedMap(lambda grid: replace(grid, origin=shift.compose(grid.origin)))


class Outdated(Spec, Fault):
    """The map of the stack misses existing obstacles, or shows obstacles that no longer exist.

    Example: `{sensor: map, outdated: {extra: [[[3, 1], [4, 1], [4, 2], [3, 2]]]}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Map"})
    neutral_values: ClassVar[Mapping[str, object]] = {"missing": [], "extra": []}
    missing: Rings = []
    """Polygons, each a list of corners [x, y], in which the map shows free space."""
    extra: Rings = []
    """Polygons, each a list of corners [x, y], in which the map shows an obstacle."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _ChangedMap(self._edit_map)

    def _edit_map(self, grid: OccupancyGrid) -> OccupancyGrid:
        rows, columns = np.indices(grid.shape)
        centers = grid.center_of(np.column_stack((rows.ravel(), columns.ravel())))
        cells = grid.cells.copy()
        for rings, value in ((self.missing, FREE), (self.extra, OCCUPIED)):
            for ring in rings:
                is_inside = points_in_polygon([(x, y) for x, y in ring], centers).reshape(grid.shape)
                cells[is_inside] = value
        return replace(grid, cells=cells)


class _ChangedMap(FaultEffect):
    """Effect that changes only the map."""

    def __init__(self, change: Callable[[OccupancyGrid], OccupancyGrid]) -> None:
        self._change = change

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        return self._change(grid)
