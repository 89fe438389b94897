"""Paths that are straight, apart from a detour near the start."""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.planning_window import crop_costmap
from simscen.stack.protocols import CostmapView, NavigationFailure

MAX_COSTLY_RATIO = 0.5
"""Maximum share of a straight path that is replaced by a detour around costly cells (see `straight_path`)."""
DETOUR_END_DISTANCE_M = 2.0
"""Distance along the straight line from the last costly cell to the end of the detour."""
CROP_MARGIN_M = 2.0
"""Margin around the start and the end of the detour of the part of the costmap in which the detour is planned."""
MAX_COST_RATIO = 1.01
"""Maximum ratio of the cost of a path with a detour to the straight distance."""
PlanPart = Callable[[CostmapView, Pose2], tuple[Array, float]]
"""Function that returns a path (n, 2) to a pose on a part of the costmap, and its cost. Raises NavigationFailure."""


def straight_path(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float, plan_part: PlanPart) -> Array | None:
    """Return a path (n, 2) that is straight, apart from a detour by `plan_part` around costly cells near the start.

    This avoids a search of the entire costmap. None if no detour is found, or if there may be a cheaper path.
    `costly_distance` defines costly cells.
    """
    length = start.distance(goal)
    costly = costly_distance(costmap, start, goal, radius)
    if costly == 0.0:
        return np.array((start[:2], goal[:2]))
    if costly + DETOUR_END_DISTANCE_M > MAX_COSTLY_RATIO * length:
        return None
    ratio = (costly + DETOUR_END_DISTANCE_M) / length
    part_goal = Pose2(start.x + ratio * (goal.x - start.x), start.y + ratio * (goal.y - start.y))
    part = crop_costmap(costmap, start, part_goal, CROP_MARGIN_M)
    if part is None:
        return None
    try:
        points, cost = plan_part(part, part_goal)
    except NavigationFailure:
        return None
    is_cheap = cost + (1.0 - ratio) * length <= MAX_COST_RATIO * length
    return np.vstack((points, goal[:2])) if is_cheap and np.allclose(points[-1], part_goal[:2]) else None


def costly_distance(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float) -> float:
    """Return the distance in m from the start to the end of the last costly cell on the straight line to the goal.

    A cell is costly if its cost is not 0, or if an obstacle is within `radius` m. Returns 0 without costly cells, and
    inf if the line leaves the costmap.
    """
    columns, rows, leaving_ratios = _cells_on_line(costmap, start, goal)
    height, width = costmap.costs.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return math.inf
    costly = (costmap.costs[rows, columns] != 0) | (costmap.distance[rows, columns] <= radius)
    return float(leaving_ratios[costly].max(initial=0.0)) * start.distance(goal)


def _cells_on_line(
    costmap: CostmapView, start: Pose2, goal: Pose2
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return columns and rows of the cells on a straight line, and where the line leaves each cell (0 start … 1 goal).

    All three have the shape (n,).
    """
    crossings = [np.array((0.0, 1.0))]
    origin, direction = np.empty(2), np.empty(2)
    for axis, (start_coordinate, end) in enumerate(((start.x, goal.x), (start.y, goal.y))):
        origin[axis] = (start_coordinate - costmap.origin[axis]) / costmap.resolution
        direction[axis] = (end - start_coordinate) / costmap.resolution
        first, last = sorted((origin[axis], origin[axis] + direction[axis]))
        if last > first:
            crossings.append((np.arange(math.ceil(first), math.floor(last) + 1) - origin[axis]) / direction[axis])
    ratios = np.sort(np.concatenate(crossings))
    centers = origin[:, None] + direction[:, None] * (0.5 * (ratios[1:] + ratios[:-1]))
    columns, rows = np.floor(centers).astype(np.int64)
    return columns, rows, ratios[1:]
