"""Faults of the localizer and of the map: `jump`, `shift`, and `outdated`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Belief
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.places import Ring
from simscen.spec.quantities import Angle, Length

if TYPE_CHECKING:
    import numpy.typing as npt


class Jump(Spec, Fault):
    """The navigator is told to be elsewhere from one moment to the next: a localizer that takes one aisle for another.

    The jump is that of the robot's pose when the fault begins, in its own frame; from then on the map is off by it as
    seen from the robot, until the fault ends and the belief jumps back. The localizer itself goes on undisturbed.

    Example: `{sensor: localizer, jump: {x: 1 m, yaw: 10 deg}, when: {time: 5 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Belief"})
    idle: ClassVar[Mapping[str, object]] = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    yaw: Angle = 0.0
    """Anticlockwise."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With the next belief."""
        return _Jumped(Pose2(self.x, self.y, self.yaw))


class _Jumped(Disturbance):
    def __init__(self, by: Pose2) -> None:
        self._by = by
        self._moved: Pose2 | None = None

    def belief(self, belief: Belief) -> Belief:
        if self._moved is None:
            self._moved = belief.pose.compose(self._by).compose(belief.pose.inverse())
        moved = self._moved
        return replace(belief, pose=moved.compose(belief.pose), map_from_odom=moved.compose(belief.map_from_odom))


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


Rings = Annotated[list[Ring], Field(max_length=100)]


class Outdated(Spec, Fault):
    """The map that the stack gets shows nothing where something stands, or something where nothing is any more.

    Example: `{sensor: map, outdated: {extra: [[[3, 1], [4, 1], [4, 2], [3, 2]]]}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Map"})
    idle: ClassVar[Mapping[str, object]] = {"missing": [], "extra": []}
    missing: Rings = []
    """Areas, by their corners, in which the map shows free space, whatever stands there."""
    extra: Rings = []
    """Areas in which the map shows an obstacle, whatever stands there."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Before the stack gets it."""
        return _Drawn(self)


class _Drawn(Disturbance):
    def __init__(self, spec: Outdated) -> None:
        self._spec = spec

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        rows, columns = np.indices(grid.shape)
        centers = grid.center_of(np.column_stack((rows.ravel(), columns.ravel())))
        cells = grid.cells.copy()
        for rings, value in ((self._spec.missing, FREE), (self._spec.extra, OCCUPIED)):
            for ring in rings:
                within = covered([(x, y) for x, y in ring], centers).reshape(grid.shape)
                cells[within] = value
        return replace(grid, cells=cells)


def covered(corners: list[tuple[float, float]], points: Array) -> npt.NDArray[np.bool_]:
    """Which of the points (n, 2) lie inside the polygon (even-odd rule)."""
    within = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if ay != by:
            crosses = (ay > points[:, 1]) != (by > points[:, 1])
            within ^= crosses & (points[:, 0] < ax + (points[:, 1] - ay) / (by - ay) * (bx - ax))
    return within
