"""The straight way: no meter costs less than 1, so where nothing on it costs anything none is cheaper.

Where its begin is dear, beside an obstacle or where the robot would meet what moves, the way past that is searched for
only, and straight on from there is as good as any other, as long as all of it costs hardly more than the straight way
is long.
"""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.planning_window import window
from simscen.stack.protocols import CostmapView, NavigationFailure

MOST_DEAR = 0.5
"""Of the way, what may be searched for: of a longer part that is no less than of all."""
BEYOND, BESIDE = 2.0, 2.0
"""Meters behind what is dear of the straight way, and on all sides of both ends, in which the way past is sought."""
HARDLY_DEARER = 1.01
"""How much more than its length (ratio) the whole may cost then. Plans are promised within 5 % of the optimum."""
Past = Callable[[CostmapView, Pose2], tuple[Array, float]]
"""From a part of a costmap and a pose on it to a way there (n, 2), and its cost. Raises NavigationFailure."""


def straight_on(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float, past: Past) -> Array | None:
    """Points (n, 2) from start to goal, straight on or `past` what is dear before; None where that may be too dear."""
    length = start.distance(goal)
    dear = dear_until(costmap, start, goal, radius)
    if dear == 0.0:
        return np.array((start[:2], goal[:2]))
    if dear + BEYOND > MOST_DEAR * length:
        return None
    share = (dear + BEYOND) / length
    there = Pose2(start.x + share * (goal.x - start.x), start.y + share * (goal.y - start.y))
    part = window(costmap, start, there, BESIDE)
    if part is None:
        return None
    try:
        points, cost = past(part, there)
    except NavigationFailure:
        return None
    hardly = cost + (1.0 - share) * length <= HARDLY_DEARER * length
    return np.vstack((points, goal[:2])) if hardly and np.allclose(points[-1], there[:2]) else None


def dear_until(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float) -> float:
    """Meters from the start up to which something that a robot of this radius passes straight to the goal costs more
    than its length: 0 where nothing does, inf where it leads off the costmap.
    """
    columns, rows, left = _passed(costmap, start, goal)
    height, width = costmap.costs.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return math.inf
    dear = (costmap.costs[rows, columns] != 0) | (costmap.distance[rows, columns] <= radius)
    return float(left[dear].max(initial=0.0)) * start.distance(goal)


def _passed(
    costmap: CostmapView, start: Pose2, goal: Pose2
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Column and row of each cell that the straight way leads through, and the share of the way at which it leaves it.

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
    columns, rows = np.floor(middles).astype(np.int64)
    return columns, rows, at[1:]
