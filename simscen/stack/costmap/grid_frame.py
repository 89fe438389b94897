"""Grid geometry of a costmap: the position of its cells, and the window of a rolling costmap."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.beams import Plane

Cells = npt.NDArray[np.int64]
_least, _most = np.minimum.reduce, np.maximum.reduce
CellIndices = npt.NDArray[np.int64]
"""Cells (n,) by number: row by row, from cell (0, 0) on."""

MAX_CACHED_CELLS = 10_000
"""Cells of a grid of which all centers are kept: those of a local costmap."""


@dataclass(frozen=True)
class GridFrame:
    """An unrotated grid: `origin` is the corner of cell (0, 0) in the map frame, `shape` is (rows, columns)."""

    origin: tuple[float, float]
    resolution: float
    shape: tuple[int, int]

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell under a point; may lie off the grid."""
        scale = 1.0 / self.resolution
        return math.floor((y - self.origin[1]) * scale), math.floor((x - self.origin[0]) * scale)

    def cells(self, points: Array) -> Cells:
        """Cells (n, 2) as (row, column) under points (n, 2); may lie off the grid."""
        local = (points - np.array(self.origin)) * (1.0 / self.resolution)
        cells: Cells = np.floor(local[:, ::-1]).astype(np.int64)
        return cells

    def centers(self, cells: Cells) -> Array:
        """Points (n, 2) of the centers of cells (n, 2)."""
        points: Array = (cells[:, ::-1] + 0.5) * self.resolution + np.array(self.origin)
        return points

    def inside(self, cells: Cells) -> npt.NDArray[np.bool_]:
        """Which of the cells (n, 2) lie on the grid."""
        rows, columns = cells[:, 0], cells[:, 1]
        return (rows >= 0) & (columns >= 0) & (rows < self.shape[0]) & (columns < self.shape[1])

    def numbers(self, points: Plane, center: complex, reach: float) -> CellIndices:
        """Return the cells under those points (n,) that lie on the grid; all are within `reach` of `center`.

        Where all of that is on the grid, nobody is asked.
        """
        local = points - complex(*self.origin)
        local *= 1.0 / self.resolution
        flat, some = local.view(np.float64), not self._holds(center, reach + self.resolution)
        if some:
            np.floor(flat, out=flat)  # where all are positive, to cut off does the same
        cells = flat.astype(np.int64).reshape(-1, 2)
        numbers: CellIndices = cells.dot(self._steps)
        if some:
            off = cells.view(np.uint64)  # below zero is far beyond every grid without a sign
            numbers = numbers[(off[:, 0] < self.shape[1]) & (off[:, 1] < self.shape[0])]
        return numbers

    def _holds(self, center: complex, reach: float) -> bool:
        """Return whether the circle of radius `reach` m around a point lies on the grid."""
        (left, low), (rows, columns), x, y = self.origin, self.shape, center.real, center.imag
        wide, high = columns * self.resolution, rows * self.resolution
        return left + reach <= x <= left + wide - reach and low + reach <= y <= low + high - reach

    @cached_property
    def _steps(self) -> CellIndices:
        """Factors that turn the column and row of a cell into its number."""
        return np.array((1, self.shape[1]))

    def points(self, numbers: CellIndices) -> Plane:
        """Return the centers (n,) of cells."""
        corner, (rows, columns) = complex(*self.origin), self.shape
        if rows * columns > MAX_CACHED_CELLS:
            return _middles(numbers, columns, self.resolution, corner)
        points: Plane = _centers(self.shape, self.resolution).take(numbers)
        points += corner
        return points

    def extent(self, numbers: CellIndices) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return the lowest and the highest row and column of at least one cell."""
        width = self.shape[1]
        first, last, columns = int(_least(numbers)), int(_most(numbers)), numbers % width
        return (first // width, int(_least(columns))), (last // width, int(_most(columns)))

    def covers(self, x: float, y: float) -> bool:
        """Return whether the point lies on the grid."""
        column, row = (x - self.origin[0]) / self.resolution, (y - self.origin[1]) / self.resolution
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1]

    def within(self, window: tuple[slice, slice], numbers: CellIndices) -> CellIndices:
        """Cells of a window, which are given as numbers in it."""
        (rows, columns), width = window, self.shape[1]
        wide = max(1, columns.stop - columns.start)
        cells: CellIndices = numbers + numbers // wide * (width - wide) + (rows.start * width + columns.start)
        return cells

    def window(self, low: tuple[int, int], high: tuple[int, int], margin: int) -> tuple[slice, slice]:
        """Return the cells from `low` to `high` (inclusive) with `margin` more on each side, clipped to the grid."""
        return (
            slice(max(0, low[0] - margin), max(0, min(self.shape[0], high[0] + 1 + margin))),
            slice(max(0, low[1] - margin), max(0, min(self.shape[1], high[1] + 1 + margin))),
        )


def _middles(numbers: CellIndices, columns: int, edge: float, corner: complex = 0j) -> Plane:
    """Return the centers x + iy (n,) of cells of a grid with this corner."""
    up, across = np.divmod(numbers, columns)
    middles: Plane = up * (1j * edge) + (across * edge + (corner + (0.5 + 0.5j) * edge))
    return middles


@lru_cache(maxsize=8)
def _centers(shape: tuple[int, int], edge: float) -> Plane:
    """Return the centers of all cells of a grid, relative to its corner."""
    return _middles(np.arange(shape[0] * shape[1]), shape[1], edge)


Cell = TypeVar("Cell", bound=np.generic)

GOAL_EDGE_MARGIN_M = 0.6
"""Distance inside the edge of the window of the intermediate goal for a goal beyond it."""
ROLL_RATIO = 1 / 8
"""The window is moved when the robot is this part of its size away from its middle, …"""
MAX_ROLL_OFFSET_M = 0.25
"""… and a local costmap's at the latest when it is so many meters away: Nav2 moves it at each update."""


def window_around(center: Pose2, size: tuple[float, float], resolution: float) -> GridFrame:
    """Return a window of this size in m around a point, aligned with a fixed grid in the plane."""
    columns, rows = (math.ceil(edge / resolution) for edge in size)
    column, row = round(center.x / resolution) - columns // 2, round(center.y / resolution) - rows // 2
    return GridFrame((column * resolution, row * resolution), resolution, (rows, columns))


def should_roll(frame: GridFrame, base: Pose2, no_farther: float = math.inf) -> bool:
    """Return whether the robot is so far from the center that the window should follow."""
    rows, columns = frame.shape
    across, up = columns * frame.resolution, rows * frame.resolution
    off = abs(base.x - frame.origin[0] - across / 2), abs(base.y - frame.origin[1] - up / 2)
    return off[0] > min(ROLL_RATIO * across, no_farther) or off[1] > min(ROLL_RATIO * up, no_farther)


def shift_layer(layer: npt.NDArray[Cell], before: GridFrame, now: GridFrame, new: float) -> npt.NDArray[Cell]:
    """Return the layer copied to another window of the same size; cells without a source get the value `new`."""
    moved = np.full(now.shape, new, dtype=layer.dtype)
    steps = [round((now.origin[axis] - before.origin[axis]) / now.resolution) for axis in (1, 0)]
    kept = [_kept(step, cells) for step, cells in zip(steps, before.shape, strict=True)]
    target = tuple(slice(first - step, last - step) for (first, last), step in zip(kept, steps, strict=True))
    moved[target] = layer[tuple(slice(first, last) for first, last in kept)]
    return moved


def _kept(step: int, cells: int) -> tuple[int, int]:
    """Return the first and one past the last of the cells in a row that remain after a shift by `step`."""
    first = min(max(0, step), cells)
    return first, max(first, min(cells, cells + step))


def clip_goal(frame: GridFrame, start: Pose2, goal: Pose2) -> Pose2:
    """Return the goal; if it is beyond the window, the point of the straight line to it just inside the edge."""
    if frame.covers(goal.x, goal.y):
        return goal
    across, up = frame.shape[1] * frame.resolution, frame.shape[0] * frame.resolution
    part = 1.0
    for here, there, low, size in (
        (start.x, goal.x, frame.origin[0], across),
        (start.y, goal.y, frame.origin[1], up),
    ):
        if there != here:
            edge = low + size - GOAL_EDGE_MARGIN_M if there > here else low + GOAL_EDGE_MARGIN_M
            part = min(part, max(0.0, (edge - here) / (there - here)))
    dx, dy = goal.x - start.x, goal.y - start.y
    return Pose2(start.x + part * dx, start.y + part * dy, math.atan2(dy, dx))
