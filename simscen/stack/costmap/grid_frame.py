"""Grid geometry of a costmap: conversion between points and cells, and the rolling window around a robot."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.beams import ComplexPoints

Cells = npt.NDArray[np.int64]
"""Cells (n, 2) as (row, column)."""
CellIndices = npt.NDArray[np.int64]
"""Flat indices (n,) of cells, row by row from cell (0, 0)."""
Mask = npt.NDArray[np.bool_]
"""Marked cells (rows, columns), or marked points (n,)."""
ValueType = TypeVar("ValueType", bound=np.generic)

MAX_CACHED_CELLS = 10_000
"""Maximum number of cells of a grid for which cell centers are cached."""


@dataclass(frozen=True)
class GridFrame:
    """An unrotated grid in the frame of its costmap.

    origin:      corner (x, y) of cell (0, 0) in m, which has the lowest x and y
    resolution:  cell size in m
    shape:       number of (rows, columns)
    """

    origin: tuple[float, float]
    resolution: float
    shape: tuple[int, int]

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell (row, column) at a point. The cell may be outside the grid."""
        scale = 1.0 / self.resolution
        return math.floor((y - self.origin[1]) * scale), math.floor((x - self.origin[0]) * scale)

    def cells(self, points: Array) -> Cells:
        """Return the cells (n, 2) at points (n, 2). Cells may be outside the grid."""
        local = (points - np.array(self.origin)) * (1.0 / self.resolution)
        cells: Cells = np.floor(local[:, ::-1]).astype(np.int64)
        return cells

    def centers(self, cells: Cells) -> Array:
        """Return the centers (n, 2) of cells (n, 2)."""
        points: Array = (cells[:, ::-1] + 0.5) * self.resolution + np.array(self.origin)
        return points

    def inside(self, cells: Cells) -> npt.NDArray[np.bool_]:
        """Return which of the cells (n, 2) are on the grid."""
        rows, columns = cells[:, 0], cells[:, 1]
        return (rows >= 0) & (columns >= 0) & (rows < self.shape[0]) & (columns < self.shape[1])

    def indices_of(self, points: ComplexPoints, center: complex, reach: float) -> CellIndices:
        """Return the flat indices of the cells at points x + iy (n,). Points outside the grid are left out.

        All points must be within `reach` m of `center`. If this circle lies on the grid, the points are not checked.
        """
        local = points - complex(*self.origin)
        local *= 1.0 / self.resolution
        flat, may_leave_grid = local.view(np.float64), not self._contains_circle(center, reach + self.resolution)
        if may_leave_grid:
            np.floor(flat, out=flat)  # not needed for positive values, which are truncated
        cells = flat.astype(np.int64).reshape(-1, 2)
        indices: CellIndices = cells.dot(self._index_factors)
        if may_leave_grid:
            offset = cells.view(np.uint64)  # negative values become larger than any grid
            indices = indices[(offset[:, 0] < self.shape[1]) & (offset[:, 1] < self.shape[0])]
        return indices

    def _contains_circle(self, center: complex, reach: float) -> bool:
        """Return whether the circle of radius `reach` m around a point lies on the grid."""
        (left, low), (rows, columns), x, y = self.origin, self.shape, center.real, center.imag
        width, height = columns * self.resolution, rows * self.resolution
        return left + reach <= x <= left + width - reach and low + reach <= y <= low + height - reach

    @cached_property
    def _index_factors(self) -> CellIndices:
        """Factors of (column, row) in the flat index of a cell."""
        return np.array((1, self.shape[1]))

    def points(self, indices: CellIndices) -> ComplexPoints:
        """Return the centers x + iy (n,) of the cells with these flat indices (n,)."""
        corner, (rows, columns) = complex(*self.origin), self.shape
        if rows * columns > MAX_CACHED_CELLS:
            return _cell_centers(indices, columns, self.resolution, corner)
        points: ComplexPoints = _all_cell_centers(self.shape, self.resolution).take(indices)
        points += corner
        return points

    def extent(self, indices: CellIndices) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return the bounding box of at least one cell: lowest (row, column) and highest (row, column)."""
        width, lowest, highest = self.shape[1], np.minimum.reduce, np.maximum.reduce
        first, last, columns = int(lowest(indices)), int(highest(indices)), indices % width
        return (first // width, int(lowest(columns))), (last // width, int(highest(columns)))

    def covers(self, x: float, y: float) -> bool:
        """Return whether the cell at the point (x, y) is on the grid."""
        row, column = self.cell(x, y)
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1]

    def from_window(self, window: tuple[slice, slice], indices: CellIndices) -> CellIndices:
        """Return the flat indices in the grid for flat indices in a window (rows, columns)."""
        (rows, columns), width = window, self.shape[1]
        window_width = max(1, columns.stop - columns.start)
        cells: CellIndices = (
            indices + indices // window_width * (width - window_width) + (rows.start * width + columns.start)
        )
        return cells

    def window(self, low: tuple[int, int], high: tuple[int, int], margin: int) -> tuple[slice, slice]:
        """Return the window (rows, columns) from cell `low` to `high`, enlarged by `margin` cells, within the grid."""
        return (
            slice(max(0, low[0] - margin), max(0, min(self.shape[0], high[0] + 1 + margin))),
            slice(max(0, low[1] - margin), max(0, min(self.shape[1], high[1] + 1 + margin))),
        )


def _cell_centers(indices: CellIndices, columns: int, size: float, corner: complex = 0j) -> ComplexPoints:
    """Return the centers x + iy (n,) of cells of `size` m in a grid with this number of columns and corner."""
    up, across = np.divmod(indices, columns)
    centers: ComplexPoints = up * (1j * size) + (across * size + (corner + (0.5 + 0.5j) * size))
    return centers


@lru_cache(maxsize=8)
def _all_cell_centers(shape: tuple[int, int], size: float) -> ComplexPoints:
    """Return the centers of all cells of a grid, relative to its corner."""
    return _cell_centers(np.arange(shape[0] * shape[1]), shape[1], size)


GOAL_EDGE_MARGIN_M = 0.6
"""Distance from the edge of the window at which a plan ends if the goal is outside the window."""
ROLL_RATIO = 1 / 8
"""A window is moved when the robot is farther from the window's center than this fraction of its size."""
MAX_ROLL_OFFSET_M = 0.25
"""The window of a local costmap is moved when the robot is farther than this from the window's center."""


def window_around(center: Pose2, size: tuple[float, float], resolution: float) -> GridFrame:
    """Return a window of `size` (x, y) in m around a pose. Cells of different windows align."""
    columns, rows = (math.ceil(length / resolution) for length in size)
    column, row = round(center.x / resolution) - columns // 2, round(center.y / resolution) - rows // 2
    return GridFrame((column * resolution, row * resolution), resolution, (rows, columns))


def should_roll(frame: GridFrame, base: Pose2, max_offset: float = math.inf) -> bool:
    """Return whether the robot is too far from the center: more than ROLL_RATIO of the size, or `max_offset` m."""
    rows, columns = frame.shape
    across, up = columns * frame.resolution, rows * frame.resolution
    offset = abs(base.x - frame.origin[0] - across / 2), abs(base.y - frame.origin[1] - up / 2)
    return offset[0] > min(ROLL_RATIO * across, max_offset) or offset[1] > min(ROLL_RATIO * up, max_offset)


def shift_layer(
    layer: npt.NDArray[ValueType], old_frame: GridFrame, new_frame: GridFrame, fill: float
) -> npt.NDArray[ValueType]:
    """Return a copy of the layer for another window of the same size. New cells get the value `fill`."""
    shifted = np.full(new_frame.shape, fill, dtype=layer.dtype)
    steps = [round((new_frame.origin[axis] - old_frame.origin[axis]) / new_frame.resolution) for axis in (1, 0)]
    remaining = [_remaining_range(step, cells) for step, cells in zip(steps, old_frame.shape, strict=True)]
    target = tuple(slice(first - step, last - step) for (first, last), step in zip(remaining, steps, strict=True))
    shifted[target] = layer[tuple(slice(first, last) for first, last in remaining)]
    return shifted


def _remaining_range(step: int, cells: int) -> tuple[int, int]:
    """Return the range (first, end) of cells along an axis that remain in the window after a shift by `step` cells."""
    first = min(max(0, step), cells)
    return first, max(first, min(cells, cells + step))


def clip_goal(frame: GridFrame, start: Pose2, goal: Pose2) -> Pose2:
    """Return the goal; if it is outside the window, a pose inside the window on the line from start to goal."""
    if frame.covers(goal.x, goal.y):
        return goal
    across, up = frame.shape[1] * frame.resolution, frame.shape[0] * frame.resolution
    fraction = 1.0
    for start_coordinate, goal_coordinate, low, size in (
        (start.x, goal.x, frame.origin[0], across),
        (start.y, goal.y, frame.origin[1], up),
    ):
        if goal_coordinate != start_coordinate:
            edge = low + size - GOAL_EDGE_MARGIN_M if goal_coordinate > start_coordinate else low + GOAL_EDGE_MARGIN_M
            fraction = min(fraction, max(0.0, (edge - start_coordinate) / (goal_coordinate - start_coordinate)))
    dx, dy = goal.x - start.x, goal.y - start.y
    return Pose2(start.x + fraction * dx, start.y + fraction * dy, math.atan2(dy, dx))
