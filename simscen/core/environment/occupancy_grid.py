"""Occupancy grids with the meaning of nav_msgs/OccupancyGrid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Pose2

if TYPE_CHECKING:
    import numpy.typing as npt

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

MAX_CELLS = 2**24
"""What a large coarse map may be refined to; costs and distances of so many cells take some 200 MB."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map: `cells` (height, width) int8 with 0 free … 100 occupied, -1 unknown.

    Row 0 is the lowest y of the grid's own frame. `resolution` in m per cell; `origin` is the corner of cell (0, 0)
    in the map frame, its yaw turns the whole grid.
    """

    cells: npt.NDArray[np.int8]
    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) in cells."""
        return self.cells.shape[0], self.cells.shape[1]

    def refined(self, finest: float) -> OccupancyGrid:
        """The same map in whole parts of its cells, none larger than `finest` meters as long as there are not too many.

        A cell as large as a robot is a poor place to plan to, and half of it a poor bound on where its wall begins.
        """
        rows, columns = self.shape
        most = math.isqrt(MAX_CELLS // max(1, rows * columns))
        parts = min(most, math.ceil(self.resolution / finest - 1e-6))
        return self if parts <= 1 else _split(self, parts)

    def cell_of(self, points: Array) -> npt.NDArray[np.int64]:
        """Cells (n, 2) as (row, column) of map points (n, 2); may lie outside the grid."""
        local = self.origin.inverse().apply(points) / self.resolution
        return np.floor(local[:, ::-1]).astype(np.int64)

    def center_of(self, cells: npt.NDArray[np.int64]) -> Array:
        """Map points (n, 2) of the centers of cells (n, 2) given as (row, column)."""
        return self.origin.apply((cells[:, ::-1].astype(np.float64) + 0.5) * self.resolution)

    def inside(self, cells: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Which of the cells (n, 2) lie on the grid."""
        result: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < self.shape), axis=1)
        return result

    def values_at(self, points: Array) -> npt.NDArray[np.int8]:
        """Cell values (n,) under map points (n, 2); points off the grid are UNKNOWN."""
        cells = self.cell_of(points)
        values = np.full(len(points), UNKNOWN, dtype=np.int8)
        known = self.inside(cells)
        values[known] = self.cells[cells[known, 0], cells[known, 1]]
        return values


@cached_on_instance
def _split(grid: OccupancyGrid, parts: int) -> OccupancyGrid:
    cells = grid.cells.repeat(parts, axis=0).repeat(parts, axis=1)
    return OccupancyGrid(cells, grid.resolution / parts, grid.origin)
