"""Planning on large costmaps: searches a window around start and goal first, and enlarges the window if necessary."""

import contextlib
import math
from collections.abc import Callable
from dataclasses import replace

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.protocols import CostmapView, NavigationFailure

MAX_FULL_SEARCH_CELLS = 1_000_000
"""Maximum size of a costmap that is searched without windows: 50 x 50 m with a cell size of 5 cm."""
WINDOW_MARGIN_M = 10.0
"""Minimum margin of the first window around start and goal."""
WINDOW_MARGIN_RATIO = 1 / 3
"""Margin of the first window as a fraction of the distance from start to goal."""

PlanFunction = Callable[[CostmapView, Pose2, Pose2, int], Path]
"""Function with the parameters and the result of `Planner.plan`."""


def plan_in_windows(plan: PlanFunction, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
    """Call `plan` for a window around start and goal, then for larger windows, and finally for the whole costmap.

    A path in a window is returned only if no path that leaves the window can be shorter. Raises NavigationFailure if
    the last call does.
    """
    margin = max(WINDOW_MARGIN_M, WINDOW_MARGIN_RATIO * start.distance(goal))
    while costmap.costs.size > MAX_FULL_SEARCH_CELLS:
        window = crop_costmap(costmap, start, goal, margin)
        if window is None or 2 * window.costs.size > costmap.costs.size:
            break
        with contextlib.suppress(NavigationFailure):
            path = plan(window, start, goal, seed)
            if path.length() <= _min_length_outside(costmap, window, start, goal):
                return path
        margin *= 2
    return plan(costmap, start, goal, seed)


def crop_costmap(costmap: CostmapView, start: Pose2, goal: Pose2, margin: float) -> CostmapView | None:
    """Return the costmap around start and goal, with a margin in m; None if start or goal is off the map."""
    (rows, columns), size = costmap.costs.shape, costmap.resolution
    low, high = [], []
    for ends, corner, cells in (
        ((start.y, goal.y), costmap.origin[1], rows),
        ((start.x, goal.x), costmap.origin[0], columns),
    ):
        if min(ends) < corner or max(ends) >= corner + cells * size:
            return None
        low.append(max(0, math.floor((min(ends) - margin - corner) / size)))
        high.append(min(cells, math.ceil((max(ends) + margin - corner) / size)))
    window = slice(low[0], high[0]), slice(low[1], high[1])
    origin = costmap.origin[0] + low[1] * size, costmap.origin[1] + low[0] * size
    return replace(costmap, costs=costmap.costs[window], distance=costmap.distance[window], origin=origin)


def _min_length_outside(costmap: CostmapView, window: CostmapView, start: Pose2, goal: Pose2) -> float:
    """Return the minimum length in m of a path that leaves a window of the costmap; inf if no path can leave it.

    For each side of the window inside the costmap, the shortest path touches the side: its length is the distance from
    the start to the mirror image of the goal at the side.
    """
    shortest = math.inf
    for axis, start_coordinate, goal_coordinate, lateral in (
        (0, start.x, goal.x, goal.y - start.y),
        (1, start.y, goal.y, goal.x - start.x),
    ):
        low, high = _sides(window, axis)
        first, last = _sides(costmap, axis)
        if low > first + window.resolution / 2:
            shortest = min(shortest, math.hypot(start_coordinate - low + goal_coordinate - low, lateral))
        if high < last - window.resolution / 2:
            shortest = min(shortest, math.hypot(high - start_coordinate + high - goal_coordinate, lateral))
    return shortest


def _sides(costmap: CostmapView, axis: int) -> tuple[float, float]:
    """Return the minimum and maximum x (axis 0) or y (axis 1) of a costmap in m."""
    begin = costmap.origin[axis]
    return begin, begin + costmap.costs.shape[1 - axis] * costmap.resolution
