"""The straight way, where all of it is free: no way costs less than its length, so none is cheaper."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.protocols import CostmapView


def free_straight_on(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float) -> bool:
    """Whether everything that a robot of this radius would pass straight from start to goal costs nothing."""
    columns, rows = _passed(costmap, start, goal)
    height, width = costmap.costs.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return False
    return bool((costmap.costs[rows, columns] == 0).all() and (costmap.distance[rows, columns] > radius).all())


def _passed(costmap: CostmapView, start: Pose2, goal: Pose2) -> npt.NDArray[np.int64]:
    """Column and row (2, n) of each cell that the straight way leads through.

    Between two lines of the grid it is in one cell: that of the middle between where it crosses them.
    """
    crossed = [np.array((0.0, 1.0))]
    begin, onward = np.empty(2), np.empty(2)
    for axis, (here, there) in enumerate(((start.x, goal.x), (start.y, goal.y))):
        begin[axis] = (here - costmap.origin[axis]) / costmap.resolution
        onward[axis] = (there - here) / costmap.resolution
        first, last = sorted((begin[axis], begin[axis] + onward[axis]))
        if last > first:
            crossed.append((np.arange(math.ceil(first), math.floor(last) + 1) - begin[axis]) / onward[axis])
    at = np.sort(np.concatenate(crossed))
    middles = begin[:, None] + onward[:, None] * (0.5 * (at[1:] + at[:-1]))
    return np.floor(middles).astype(np.int64)
