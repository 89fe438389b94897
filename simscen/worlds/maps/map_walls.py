"""Walls of a world from the occupied cells of a map."""

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Mesh, Solid

Cells = npt.NDArray[np.bool_]
Runs = npt.NDArray[np.int64]

MIN_OCCUPIED_VALUE = 65
"""Cells with values from this to 100 are walls: Nav2's occupied_thresh, for maps in mode scale or raw."""
MAX_EDGES = 500_000
"""Maximum number of straight edges. A building of 16 million cells has about 10 000, noise has one per cell."""


def walls_from_map(grid: OccupancyGrid, height: float, name: str = "map") -> list[Solid]:
    """Return the occupied cells of a map as one closed mesh, `height` m tall; empty without occupied cells.

    A straight edge of any length becomes one face, and there are no faces between cells, so that no object can catch on
    a seam. Raises InvalidInput for a map with more than MAX_EDGES straight edges.
    """
    occupied = grid.cells >= MIN_OCCUPIED_VALUE
    if not occupied.any():
        return []
    corners = np.concatenate((_sides(occupied, name), _caps(occupied, name)))
    vertices = corners.reshape(-1, 3) * (grid.resolution, grid.resolution, height)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate((first + np.array([0, 1, 2]), first + np.array([0, 2, 3]))).astype(np.int32)
    return [Solid(Mesh(vertices, faces), Pose3.planar(grid.origin), name)]


def _sides(occupied: Cells, name: str) -> Array:
    """Return the upright faces (n, 4, 3) in cells, with height 1: one for each straight edge of the outline."""
    sides = []
    for swapped, cells in ((False, occupied), (True, occupied.T)):
        change = np.diff(np.pad(cells.astype(np.int8), ((1, 1), (0, 0))), axis=0)
        for sign in (1, -1):
            line, start, stop = _runs(change == sign, name).T
            # The wall must be on the left of the line from a to b.
            a, b = (start, stop) if (sign == 1) != swapped else (stop, start)
            ends = [np.column_stack((end, line) if not swapped else (line, end)) for end in (a, b, b, a)]
            sides.append(
                np.stack([np.column_stack((e, np.full(len(e), z))) for e, z in zip(ends, (0, 0, 1, 1), strict=True)], 1)
            )
    return np.concatenate(sides).astype(np.float64)


def _caps(occupied: Cells, name: str) -> Array:
    """Return the faces (n, 4, 3) of bottom and top, one for equal runs of cells in consecutive rows."""
    row, start, stop = _runs(occupied, name).T
    order = np.lexsort((row, stop, start))
    row, start, stop = row[order], start[order], stop[order]
    new = np.ones(len(row), dtype=np.bool_)
    new[1:] = (start[1:] != start[:-1]) | (stop[1:] != stop[:-1]) | (row[1:] != row[:-1] + 1)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(row)) - 1
    low, high, left, right = row[first], row[last] + 1, start[first], stop[first]
    zero = np.zeros(len(first), dtype=np.int64)
    ring = [(left, low), (right, low), (right, high), (left, high)]
    top = np.stack([np.column_stack((x, y, zero + 1)) for x, y in ring], axis=1)
    under = np.stack([np.column_stack((x, y, zero)) for x, y in reversed(ring)], axis=1)
    return np.concatenate((top, under)).astype(np.float64)


def _runs(lines: Cells, name: str) -> Runs:
    """Return the runs of True along the rows (n, 3): row, first column, column after the last."""
    steps = np.diff(np.pad(lines.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    count = int(np.count_nonzero(steps == 1))
    if count > MAX_EDGES:
        message = f"map too ragged to make walls of: more than {MAX_EDGES} separate edges"
        raise InvalidInput([Problem(name, 0, 0, "SC331", message, "remove the speckles from the map")])
    begin, end = np.argwhere(steps == 1), np.argwhere(steps == -1)
    return np.column_stack((begin, end[:, 1]))
