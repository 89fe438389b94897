"""Distances on the costmap's grid: what dwb_critics' MapGridCritic spreads from cell to cell, in closed form.

Its queue takes no notice of obstacles and goes by Manhattan distance; so what it finds is the least Manhattan distance
from a cell to those of the plan.
"""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.protocols import CostmapView

Cells = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
UNKNOWN = 255


def cells_of(costmap: CostmapView, points: Array) -> tuple[Cells, Mask]:
    """Cells (n, 2) as (row, column) under points (n, 2), and which lie on the costmap."""
    cells = np.floor((points[:, ::-1] - np.array(costmap.origin)[::-1]) / costmap.resolution).astype(np.int64)
    on_map: Mask = np.asarray(((cells >= 0) & (cells < np.array(costmap.costs.shape))).all(axis=1))
    return cells, on_map


def plan_cells(costmap: CostmapView, plan: Array) -> Cells:
    """The cells (m, 2) of the plan (n, 2) from where it enters the known part of the costmap to where it leaves it."""
    cells, on_map = cells_of(costmap, plan)
    known = on_map.copy()
    known[on_map] = costmap.costs[cells[on_map, 0], cells[on_map, 1]] != UNKNOWN
    if not known.any():
        return cells[:0]
    first = int(known.argmax())
    gone = np.flatnonzero(~known[first:])
    return cells[first : first + int(gone[0])] if len(gone) else cells[first:]


def manhattan(cells: Cells, sources: Cells) -> Array:
    """The least number of steps (n,) from cells (n, 2) to one of the sources (m, 2)."""
    apart = np.abs(cells[:, None, 0] - sources[None, :, 0]) + np.abs(cells[:, None, 1] - sources[None, :, 1])
    return np.asarray(apart.min(axis=1), dtype=np.float64)
