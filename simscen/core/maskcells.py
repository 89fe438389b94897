"""Filter masks as plain data, so that a log can carry them: equal cells side by side are one block."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.grid import FREE, OCCUPIED, OccupancyGrid

if TYPE_CHECKING:
    import numpy.typing as npt

Block = tuple[int, int, int, int, int]
"""Column, row, width and height in cells, and the value of them all."""


@dataclass(frozen=True)
class MaskCells:
    """The cells of a mask that say something (1 … 100), as `blocks` that do not overlap.

    `resolution` in m per cell; `origin` is the corner of cell (0, 0), as for an OccupancyGrid.
    """

    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)
    blocks: tuple[Block, ...] = ()

    @property
    def grid(self) -> OccupancyGrid:
        """The mask as cells again, as far as any say something."""
        width = max((column + width for column, _, width, _, _ in self.blocks), default=0)
        height = max((row + height for _, row, _, height, _ in self.blocks), default=0)
        cells = np.full((height, width), FREE, dtype=np.int8)
        for column, row, wide, high, value in self.blocks:
            cells[row : row + high, column : column + wide] = value
        return OccupancyGrid(cells, self.resolution, self.origin)

    @property
    def forbidden(self) -> Array:
        """The occupied blocks (n, 4): least x, least y, greatest x and greatest y in metres in the mask's own frame."""
        found = np.array([block[:4] for block in self.blocks if block[4] == OCCUPIED], dtype=np.float64).reshape(-1, 4)
        found[:, 2:] += found[:, :2]
        boxes: Array = found * self.resolution
        return boxes

    def seen_from(self, poses: Array) -> Array:
        """Poses (n, 3) of the map's frame in the mask's own."""
        local = self.origin.inverse().apply(poses[:, :2])
        return np.column_stack((local, poses[:, 2] - self.origin.yaw))


def cells_of(grid: OccupancyGrid) -> MaskCells:
    """The mask in blocks: runs of equal cells in a row, as long as the rows below have the same run."""
    blocks: list[Block] = []
    begun: dict[tuple[int, int, int], int] = {}
    for row in range(len(grid.cells) + 1):
        if 0 < row < len(grid.cells) and np.array_equal(grid.cells[row], grid.cells[row - 1]):
            continue
        runs = _runs(grid.cells[row]) if row < len(grid.cells) else []
        here = set(runs)
        for run in [run for run in begun if run not in here]:
            column, width, value = run
            blocks.append((column, begun[run], width, row - begun.pop(run), value))
        for run in runs:
            begun.setdefault(run, row)
    return MaskCells(float(grid.resolution), grid.origin, tuple(blocks))


def _runs(cells: npt.NDArray[np.int8]) -> list[tuple[int, int, int]]:
    """Column, width and value of each run of equal cells that say something."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(cells)) + 1, [len(cells)])).tolist()
    return [(a, b - a, int(cells[a])) for a, b in pairwise(edges) if b > a and cells[a] > FREE]
