"""Samples where they tell most: along the middle of what is narrow, and thinly over what is wide.

Sampling on the medial axis finds narrow passages that uniform samples miss (Wilmarth, Amato and Stiller 1999). The axis
is where the distance to the nearest obstacle falls off to both sides.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.advanced.planners.informed_set import cells_with_most_clearance, pool_blocks
from simscen.core.geometry import Array
from simscen.stack.protocols import CostmapView

BLOCK = 0.1
"""Meters, about: cells are looked at in blocks of this size."""
BESIDE = 0.2
"""Meters to either side of the axis at which the distance has to be less."""
IN_THE_TIGHT, ON_AXIS, IN_THE_OPEN = 0.3, 0.8, 1.1
"""Meters between samples."""
TIGHT = 0.15
"""Meters of room beyond the least up to which it is tight: a straight line from sample to sample hardly fits there."""
Mask = npt.NDArray[np.bool_]


def medial_axis_samples(costmap: CostmapView, free: Mask, seed: int, density: int = 1) -> Array:
    """Centers of `free` cells (n, 2), another choice for each seed; `density` times as many to the meter."""
    rng = np.random.default_rng(seed)
    factor = max(1, round(BLOCK / costmap.resolution)) if density == 1 else 1
    size = factor * costmap.resolution
    room = np.where(free, costmap.distance, np.float32(0.0))
    most = pool_blocks(room, factor, np.maximum, 0.0)
    open_ground = most >= room.max() - 1e-6
    axis = _ridges(most, max(1, round(BESIDE / size)), 0.4 * size)
    tight = axis & (most < room[free].min(initial=np.inf) + TIGHT)
    chosen = [
        _thinned(tight, IN_THE_TIGHT / density / size, rng),
        _thinned(axis, ON_AXIS / density / size, rng),
        _thinned(open_ground, IN_THE_OPEN / density / size, rng),
        _thinned((most > 0) & ~open_ground, IN_THE_OPEN / density / size, rng),
    ]
    rows, columns = cells_with_most_clearance(room, np.concatenate(chosen), factor)
    x = costmap.origin[0] + (columns + 0.5) * costmap.resolution
    y = costmap.origin[1] + (rows + 0.5) * costmap.resolution
    return np.column_stack((x, y))


def _ridges(room: npt.NDArray[np.float32], reach: int, less: float) -> Mask:
    """Blocks with room from which it gets less in two opposite directions."""
    padded = np.pad(room, reach)
    height, width = room.shape
    below = room - np.float32(less)
    ridges = np.zeros(room.shape, dtype=bool)
    slant = max(1, round(reach / math.sqrt(2.0)))
    for rows, columns in ((0, reach), (reach, 0), (slant, slant), (slant, -slant)):
        sides = [padded[reach + side * rows :, reach + side * columns :][:height, :width] < below for side in (1, -1)]
        ridges |= sides[0] & sides[1]
    return ridges & (room > 0)


def _thinned(mask: Mask, spacing: float, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """One of the blocks (n, 2) of the mask in each square of a grid that is laid anyhow."""
    cells = rng.permutation(np.flatnonzero(mask))
    rows, columns = np.divmod(cells, mask.shape[1])
    down, across = rng.uniform(0.0, spacing, 2)
    row_of_squares = int(mask.shape[1] / spacing) + 2
    square = ((rows + down) / spacing).astype(np.int64) * row_of_squares + ((columns + across) / spacing).astype(
        np.int64
    )
    chosen = np.full(int(square.max(initial=0)) + 1, -1)
    chosen[square] = cells  # the last one of each square
    return np.column_stack(np.divmod(chosen[chosen >= 0], mask.shape[1]))
