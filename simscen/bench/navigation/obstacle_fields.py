"""Obstacle fields as in the BARN dataset: cylinders on a lattice, grown by a cellular automaton.

Perille, Truong, Xiao, Stone: Benchmarking Metric Ground Navigation, SSRR 2020, section III: cells are filled at
random, then smoothed: a cell with many filled neighbors is filled, one with hardly any is cleared.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.core.random_streams import Streams

CELL = 0.15
"""Meters between cylinders; their radius is half of it."""
COLUMNS, FIELD_ROWS, ROWS = 30, 30, 64
"""Of the lattice: the field fills the upper rows, between two rows of cylinders that wall the whole lane in."""
HEIGHT = 1.0
FILL = (0.20, 0.35)
"""Least and most of the cells filled at first: gives fields as dense as the six worlds of BARN at hand, 5 … 22 %."""
FILL_AT, CLEAR_AT = 5, 1
"""Filled neighbors of eight from which a cell is filled, and up to which it is cleared."""
START, GOAL = Pose2(-2.25, 3.0, 1.57), Pose2(-2.25, 13.0, 1.57)
GAP = 0.37
"""Radius in meters of the disc that has a way through every field, as through every world of BARN."""
MAX_ATTEMPTS = 1000

Cells = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ObstacleField:
    """`centers` (n, 2) of cylinders and the length of the shortest way of the disc from START to GOAL, in m."""

    number: int
    centers: Array
    shortest: float

    @property
    def density(self) -> float:
        """Filled part of the field between its walls."""
        inside = (np.abs(self.centers[:, 0] + COLUMNS * CELL / 2) < (COLUMNS / 2 - 1) * CELL) & (
            self.centers[:, 1] > (ROWS - FIELD_ROWS) * CELL
        )
        return float(np.count_nonzero(inside)) / (FIELD_ROWS * (COLUMNS - 2))


def obstacle_field(number: int, gap: float = GAP, too_wide: float | None = None) -> ObstacleField:
    """The field of this number (from 1): always the same, and one that can be crossed.

    Density is drawn anew until a disc of radius `gap` has a way, and one of `too_wide`, where that is given, has none.
    Raises RuntimeError after MAX_ATTEMPTS (never seen).
    """
    rng = Streams(number).generator("obstacle field" if gap == GAP else f"obstacle field {gap:g}")
    for _ in range(MAX_ATTEMPTS):
        centers = _centers(_smoothed(rng))
        if _crossable(centers, gap, too_wide) and np.isfinite(length := _shortest(centers, gap)):
            return ObstacleField(number, centers, length)
    raise RuntimeError(f"no way through any of {MAX_ATTEMPTS} fields of number {number}")


def _smoothed(rng: np.random.Generator) -> Cells:
    """A field of random density and smoothness, walled at both sides; smoothed two to four times as in BARN."""
    cells: Cells = rng.random((FIELD_ROWS, COLUMNS)) < rng.uniform(*FILL)
    for _ in range(int(rng.integers(2, 5))):
        cells[:, [0, -1]] = True
        around = _neighbors(cells)
        cells = (cells | (around >= FILL_AT)) & (around > CLEAR_AT)
    cells[:, [0, -1]] = True
    return cells


def _neighbors(cells: Cells) -> npt.NDArray[np.int64]:
    """How many of the eight cells around each are filled; there is nothing beyond the edge."""
    wide = np.pad(cells.astype(np.int64), 1)
    rows, columns = cells.shape
    around = sum(wide[i : i + rows, j : j + columns] for i in range(3) for j in range(3))
    return np.asarray(around - cells)


def _centers(field: Cells) -> Array:
    """The cylinders (n, 2) of the whole lane: walls, closed behind the start, and the field at its end."""
    lane = np.zeros((ROWS, COLUMNS), np.bool_)
    lane[:, [0, -1]], lane[0] = True, True
    lane[ROWS - FIELD_ROWS :] = field
    rows, columns = np.nonzero(lane)
    return np.column_stack(((columns + 0.5 - COLUMNS) * CELL, (rows + 0.5) * CELL))


def _crossable(centers: Array, gap: float, too_wide: float | None) -> bool:
    """Whether start and goal are in one piece of the free space of a disc of `gap`, and not of one that is too wide.

    Quick, for most fields are not crossable.
    """
    from scipy import ndimage, spatial

    step = CELL / 3
    x, y = np.meshgrid(np.arange(-COLUMNS * CELL, 0.0, step), np.arange(0.0, GOAL.y + 1.0, step))
    distance, _ = spatial.cKDTree(centers).query(np.stack((x, y), axis=-1))

    def joined(radius: float) -> bool:
        pieces, _ = ndimage.label(distance > radius + CELL / 2)
        start, goal = (pieces[round(pose.y / step), round((pose.x + COLUMNS * CELL) / step)] for pose in (START, GOAL))
        return bool(start and start == goal)

    return joined(gap) and not (too_wide is not None and joined(too_wide))


def _shortest(centers: Array, gap: float) -> float:
    from simscen.worlds.geometry.triangulation import merge_solids
    from simscen.worlds.routes.shortest_paths import ShortestPaths

    pillar = Cylinder(CELL / 2, HEIGHT)
    mesh = merge_solids(tuple(Solid(pillar, Pose3(x, y, HEIGHT / 2), "") for x, y in centers.tolist()))
    # As wide as the lane, so that no way leads around its walls: those end where the field ends.
    bounds = (-COLUMNS * CELL, 0.0, 0.0, GOAL.y + 1.0)
    return ShortestPaths(mesh, bounds, gap).length(START, GOAL)
