"""`outdated`: the map shows what was there once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.places import Ring

if TYPE_CHECKING:
    import numpy.typing as npt

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
