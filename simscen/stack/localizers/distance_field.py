"""Table of the distances from map cells to the nearest obstacle, for likelihood fields and ray casting."""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array
from simscen.stack.costmap.distance_transform import (
    MAX_REACH_CELLS,
    OUT_OF_REACH,
    squared_distance_blocks,
    squared_distances_within,
)
from simscen.stack.localizers.beams import ComplexPoints, TableIndices

Float32 = npt.NDArray[np.float32]
Kind = TypeVar("Kind", np.float32, np.uint8)


BLOCK_POSES = 512
"""Number of poses that are evaluated at once."""
BLOCK_CELLS = 2**16
"""Number of cells for which a function is tabulated at once."""


def evaluate_in_blocks(evaluate: Callable[[Array], Array], poses: Array) -> Array:
    """Return the values (n,) of a function of `poses` (n, 3), evaluated in blocks that fit into the processor cache."""
    if len(poses) <= BLOCK_POSES:
        return evaluate(poses)
    return np.concatenate([evaluate(poses[begin : begin + BLOCK_POSES]) for begin in range(0, len(poses), BLOCK_POSES)])


class DistanceField:
    """Distances in m from cell centers to the nearest obstacle cell, as a flat table with a border of one cell.

    A lookup outside the map returns the value of the nearest border cell.
    """

    def __init__(self, grid: OccupancyGrid, obstacles: npt.NDArray[np.bool_], limit: float, *, walled: bool) -> None:
        """Compute the distances to `obstacles` (height, width), at most `limit` m.

        With `walled`, the border is an obstacle. Otherwise, its distance is `limit`.
        """
        bordered = np.pad(obstacles, 1, constant_values=walled)
        distance = np.full(bordered.shape, limit, dtype=np.float32)
        if bordered.any():
            if limit <= MAX_REACH_CELLS * grid.resolution:
                meters = np.minimum(np.sqrt(np.arange(OUT_OF_REACH + 1)) * grid.resolution, limit).astype(np.float32)
                distance = meters.take(squared_distances_within(bordered, math.ceil(limit / grid.resolution)))
            else:
                for rows, squared in squared_distance_blocks(bordered):
                    distance[rows] = np.minimum(np.sqrt(squared) * grid.resolution, limit)
        if not walled:
            distance[[0, -1], :] = distance[:, [0, -1]] = limit
        self.table: Float32 = distance.ravel()
        self.limit, self.resolution = limit, grid.resolution
        self._height, self._width = grid.shape
        x, y, self._turn = grid.origin.inverse()
        c, s = math.cos(self._turn), math.sin(self._turn)
        self._axes = np.array([[c, -s], [s, c]]) / grid.resolution
        self._corner = np.array([[x], [y]]) / grid.resolution + 1

    def tabulate(self, function: Callable[[Float32], npt.NDArray[Kind]], kind: type[Kind]) -> npt.NDArray[Kind]:
        """Return a flat table of the values of a function of the distance, for all cells, with elements of `kind`."""
        result = np.empty(len(self.table), kind)
        for begin in range(0, len(result), BLOCK_CELLS):
            result[begin : begin + BLOCK_CELLS] = function(self.table[begin : begin + BLOCK_CELLS])
        return result

    def coordinates(self, poses: Array) -> tuple[Float32, Float32]:
        """Convert `poses` (n, 3) to positions (2, n) in table cells, including the border, and headings (n,)."""
        positions = self._axes @ poses.T[:2] + self._corner
        return positions.astype(np.float32), (poses[:, 2] + self._turn).astype(np.float32)

    def cells(self, x: Float32, y: Float32) -> TableIndices:
        """Return the table indices of points in table coordinates, inside or outside the table. Overwrites x and y."""
        column = x.clip(0, self._width + 1, out=x).astype(np.int32)
        row = y.clip(0, self._height + 1, out=y).astype(np.int32)
        row *= self._width + 2
        row += column
        return row

    def endpoint_cells(self, poses: Array, points: ComplexPoints) -> TableIndices:
        """Return the table indices (n, b) of `points` (b,), given in the base frame of each of the `poses` (n, 3)."""
        positions, heading = self.coordinates(poses)
        count = len(heading)
        ends = np.ones((3, len(points)), dtype=np.float32)
        ends[0], ends[1] = points.real, points.imag
        ends[:2] /= np.float32(self.resolution)
        axes = np.empty((3, 2, count), dtype=np.float32)
        axes[0, 0] = axes[1, 1] = np.cos(heading)
        axes[0, 1] = np.sin(heading)
        np.negative(axes[0, 1], out=axes[1, 0])
        axes[2] = positions
        x_and_y = axes.reshape(3, -1).T @ ends
        return self.cells(x_and_y[:count], x_and_y[count:])
