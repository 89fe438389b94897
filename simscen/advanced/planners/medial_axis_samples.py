"""Random samples on the medial axis of the free space.

Sampling on the medial axis finds narrow passages that uniform samples miss (Wilmarth, Amato and Stiller 1999). On the
medial axis, the clearance (distance to the nearest obstacle) decreases to both sides.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.advanced.cell_blocks import cells_with_most_clearance, pool_blocks
from simscen.core.geometry import Array
from simscen.stack.moving_obstacles import Mask
from simscen.stack.protocols import CostmapView

BLOCK_M = 0.1
"""Approximate side length of the blocks of cells in which the medial axis is determined."""
RIDGE_OFFSET_M = 0.2
"""Distance to each side of the axis at which the clearance must be smaller."""
NARROW_SPACING_M, AXIS_SPACING_M, OPEN_SPACING_M = 0.3, 0.8, 1.1
"""Distance between samples in narrow passages, on the rest of the axis, and elsewhere."""
NARROW_MARGIN_M = 0.15
"""A block of the axis is narrow if its clearance exceeds the smallest clearance of all free cells by less than this."""


def medial_axis_samples(costmap: CostmapView, free: Mask, seed: int, density: int = 1) -> Array:
    """Return random centers (n, 2) of `free` cells: many on the medial axis, few elsewhere.

    `density` divides the distances between samples.
    """
    rng = np.random.default_rng(seed)
    factor = max(1, round(BLOCK_M / costmap.resolution)) if density == 1 else 1
    size = factor * costmap.resolution
    clearance = np.where(free, costmap.distance, np.float32(0.0))
    block_clearance = pool_blocks(clearance, factor, np.maximum, 0.0)
    is_open = block_clearance >= clearance.max() - 1e-6
    is_axis = _ridges(block_clearance, max(1, round(RIDGE_OFFSET_M / size)), 0.4 * size)
    is_narrow = is_axis & (block_clearance < clearance[free].min(initial=np.inf) + NARROW_MARGIN_M)
    chosen = [
        _thinned(is_narrow, NARROW_SPACING_M / density / size, rng),
        _thinned(is_axis, AXIS_SPACING_M / density / size, rng),
        _thinned(is_open, OPEN_SPACING_M / density / size, rng),
        _thinned((block_clearance > 0) & ~is_open, OPEN_SPACING_M / density / size, rng),
    ]
    rows, columns = cells_with_most_clearance(clearance, np.concatenate(chosen), factor)
    x = costmap.origin[0] + (columns + 0.5) * costmap.resolution
    y = costmap.origin[1] + (rows + 0.5) * costmap.resolution
    return np.column_stack((x, y))


def _ridges(clearance: npt.NDArray[np.float32], reach: int, drop: float) -> Mask:
    """Return the mask of blocks whose clearance is lower by `drop` m at `reach` blocks in two opposite directions."""
    padded = np.pad(clearance, reach)
    height, width = clearance.shape
    lowered = clearance - np.float32(drop)
    ridges = np.zeros(clearance.shape, dtype=bool)
    diagonal = max(1, round(reach / math.sqrt(2.0)))
    for rows, columns in ((0, reach), (reach, 0), (diagonal, diagonal), (diagonal, -diagonal)):
        sides = [padded[reach + side * rows :, reach + side * columns :][:height, :width] < lowered for side in (1, -1)]
        ridges |= sides[0] & sides[1]
    return ridges & (clearance > 0)


def _thinned(mask: Mask, spacing: float, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Return one random block (row, column) of the mask for each square of a grid with `spacing` in blocks."""
    cells = rng.permutation(np.flatnonzero(mask))
    rows, columns = np.divmod(cells, mask.shape[1])
    row_offset, column_offset = rng.uniform(0.0, spacing, 2)
    squares_per_row = int(mask.shape[1] / spacing) + 2
    square = ((rows + row_offset) / spacing).astype(np.int64) * squares_per_row + (
        (columns + column_offset) / spacing
    ).astype(np.int64)
    chosen = np.full(int(square.max(initial=0)) + 1, -1)
    chosen[square] = cells  # the last cell of each square stays
    return np.column_stack(np.divmod(chosen[chosen >= 0], mask.shape[1]))
