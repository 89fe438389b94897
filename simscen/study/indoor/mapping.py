"""The map that a robot has of a building: what an earlier drive saw, as SLAM would have drawn it."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

CELL = 0.05
MARGIN = 1.0
"""m around what was seen."""
REACH = 12.0
"""m: ranges beyond this are not drawn."""
SOLID = 0.25
"""Share of the beams through a cell that end there, from which on it is occupied."""


def drawn(poses: Array, angles: Array, ranges: Array, size: tuple[float, float]) -> OccupancyGrid:
    """A map of scans (n, b) taken at `poses` (n, 3): cells that beams ended in, or passed; all others are unknown."""
    width, height = (int(np.ceil((edge + 2 * MARGIN) / CELL)) for edge in size)
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    far = np.minimum(ranges, REACH)

    def counted(along: Array, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
        x = ((poses[:, :1] + c * along)[chosen] + MARGIN) / CELL
        y = ((poses[:, 1:2] + s * along)[chosen] + MARGIN) / CELL
        column, row = np.clip(x.astype(np.int64), 0, width - 1), np.clip(y.astype(np.int64), 0, height - 1)
        return np.bincount(row * width + column, minlength=height * width).astype(np.int64)

    ended = counted(far, np.isfinite(ranges) & (ranges < REACH))
    passed = np.zeros_like(ended)
    for step in np.arange(0.0, REACH, 2 * CELL):  # neighbouring beams pass the cells between
        along = np.full_like(far, step)
        if (chosen := far - step > CELL).any():
            passed += counted(along, chosen)
    cells = np.full(height * width, UNKNOWN, dtype=np.int8)
    cells[passed > 0] = FREE
    cells[(ended > 0) & (ended >= SOLID * (ended + passed))] = OCCUPIED
    return OccupancyGrid(cells.reshape(height, width), CELL, Pose2(-MARGIN, -MARGIN, 0.0))


def first_half(grid: OccupancyGrid, middle: float) -> OccupancyGrid:
    """The same map, of which nothing is known right of x = `middle`."""
    cells = grid.cells.copy()
    cells[:, int((middle - grid.origin.x) / grid.resolution) :] = UNKNOWN
    return OccupancyGrid(cells, grid.resolution, grid.origin)
