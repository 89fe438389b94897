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
"""Values of cells. Values between FREE and OCCUPIED are probabilities of occupancy in percent."""

MAX_CELLS = 2**24
"""Maximum number of cells of a map that `refined` returns."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Map with `cells` (height, width) int8: 0 free … 100 occupied, -1 unknown.

    Row 0 has the lowest y in the frame of the grid. `resolution` is in m per cell. `origin` is the pose of the corner
    of cell (0, 0) in the map frame.
    """

    cells: npt.NDArray[np.int8]
    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) in cells."""
        return self.cells.shape[0], self.cells.shape[1]

    @property
    def corners(self) -> list[tuple[float, float]]:
        """The corners (x, y) in m of the grid in the map frame, counterclockwise from the corner of cell (0, 0)."""
        height, width = (cells * self.resolution for cells in self.shape)
        local = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
        return [self.origin.compose(Pose2(x, y))[:2] for x, y in local]

    def refined(self, max_cell_size: float) -> OccupancyGrid:
        """Return the map with each cell split into equal parts, which have the value of the cell.

        The parts are at most `max_cell_size` m wide, or as small as MAX_CELLS allows.
        """
        rows, columns = self.shape
        max_parts = math.isqrt(MAX_CELLS // max(1, rows * columns))
        parts = min(max_parts, math.ceil(self.resolution / max_cell_size - 1e-6))
        return self if parts <= 1 else _split(self, parts)

    def cell_of(self, points: Array) -> npt.NDArray[np.int64]:
        """Return the cells (n, 2), as (row, column), at points (n, 2) in the map frame, also outside the grid."""
        local = self.origin.inverse().apply(points) / self.resolution
        return np.floor(local[:, ::-1]).astype(np.int64)

    def center_of(self, cells: npt.NDArray[np.int64]) -> Array:
        """Return the centers (n, 2) of cells (n, 2), given as (row, column), in the map frame."""
        return self.origin.apply((cells[:, ::-1].astype(np.float64) + 0.5) * self.resolution)

    def inside(self, cells: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Return a mask (n,) of the cells (n, 2), given as (row, column), that lie inside the grid."""
        result: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < self.shape), axis=1)
        return result

    def values_at(self, points: Array) -> npt.NDArray[np.int8]:
        """Return the cell values (n,) at points (n, 2) in the map frame; UNKNOWN outside the grid."""
        cells = self.cell_of(points)
        values = np.full(len(points), UNKNOWN, dtype=np.int8)
        known = self.inside(cells)
        values[known] = self.cells[cells[known, 0], cells[known, 1]]
        return values


@cached_on_instance
def _split(grid: OccupancyGrid, parts: int) -> OccupancyGrid:
    """Return the grid with each cell split into `parts` x `parts` cells."""
    cells = grid.cells.repeat(parts, axis=0).repeat(parts, axis=1)
    return OccupancyGrid(cells, grid.resolution / parts, grid.origin)
