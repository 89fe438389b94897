"""Check of start and goal before a search, with Nav2's error codes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import label

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.planners.path_postprocessing import spaced
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import NavigationFailure

MAX_ESCAPE_M = 0.5
"""Distance that a robot too near to an obstacle may drive to the start of a plan."""


@dataclass(frozen=True, eq=False)
class Endpoints:
    """Where the search begins and ends; they differ from what was asked where the robot could not stand there.

    `reachable` (height, width) are the cells that a way joins with the start.
    """

    start: tuple[float, float]
    goal: tuple[float, float]
    reachable: npt.NDArray[np.bool_]


def find_endpoints(rates: TraversalCosts, start: Pose2, goal: Pose2, tolerance: float) -> Endpoints:
    """Return the start and goal of the search.

    A start where the robot is too near an obstacle is moved to the nearest free place that nothing is in front of (it
    is there already). A goal is moved to the nearest place within `tolerance` that can be reached. Raises
    NavigationFailure with START_/GOAL_OUTSIDE_MAP, START_/GOAL_OCCUPIED or NO_VALID_PATH.
    """
    _possible(rates, start, ErrorCode.START_OUTSIDE_MAP, ErrorCode.START_OCCUPIED, "start")
    _possible(rates, goal, ErrorCode.GOAL_OUTSIDE_MAP, ErrorCode.GOAL_OCCUPIED, "goal")
    free = rates.free
    begin = next((place for place in near(rates, free, start, MAX_ESCAPE_M) if _open(rates, start, place)), None)
    if begin is None:
        raise NavigationFailure(ErrorCode.START_OCCUPIED, f"no free place within {MAX_ESCAPE_M} m of the start")
    if next(near(rates, free, goal, tolerance), None) is None:
        raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"no room for the robot within {tolerance} m of the goal")
    reachable = reachable_cells(rates, begin)
    end = next(near(rates, reachable, goal, tolerance), None)
    if end is None:
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, "start and goal are not connected")
    return Endpoints(begin, end, reachable)


def reachable_cells(rates: TraversalCosts, start: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Return the cells (height, width) that are connected with a free start."""
    pieces, _ = label(rates.free)
    return np.asarray(pieces == pieces[rates.cell(start)])


def _possible(rates: TraversalCosts, pose: Pose2, outside: ErrorCode, occupied: ErrorCode, what: str) -> None:
    row, column = rates.cell((pose.x, pose.y))
    if not (0 <= row < rates.height and 0 <= column < rates.width):
        raise NavigationFailure(outside, f"{what} ({pose.x:.2f}, {pose.y:.2f}) is outside the map")
    if rates.costmap.distance[row, column] == 0.0:
        raise NavigationFailure(occupied, f"{what} ({pose.x:.2f}, {pose.y:.2f}) is in an obstacle")


def near(
    rates: TraversalCosts, free: npt.NDArray[np.bool_], pose: Pose2, within: float
) -> Iterator[tuple[float, float]]:
    """Yield the point itself if its cell is free, then centers of free cells at most `within` m away."""
    row, column = rates.cell((pose.x, pose.y))
    if free[row, column]:
        yield pose.x, pose.y
    reach = math.ceil(within / rates.resolution)
    top, left = max(0, row - reach), max(0, column - reach)
    cells = np.argwhere(free[top : row + reach + 1, left : column + reach + 1]) + np.array((top, left))
    x = rates.origin[0] + (cells[:, 1] + 0.5) * rates.resolution
    y = rates.origin[1] + (cells[:, 0] + 0.5) * rates.resolution
    distance = np.hypot(x - pose.x, y - pose.y)
    for best in np.argsort(distance, kind="stable").tolist():
        if distance[best] > within:
            return
        yield float(x[best]), float(y[best])


def _open(rates: TraversalCosts, start: Pose2, place: tuple[float, float]) -> bool:
    """Return whether no obstacle is between the start and this position."""
    way = spaced(np.array([(start.x, start.y), place]), 0.5 * rates.resolution)
    columns, rows = np.floor((way - rates.origin) / rates.resolution).astype(np.int64).T
    return bool((rates.costmap.distance[rows, columns] > 0.0).all())


def reachable_bounds(costs: TraversalCosts, ends: Endpoints) -> tuple[float, float, float, float]:
    """Return the bounding box (min x, min y, max x, max y) of everything that can be reached, in m."""
    rows, columns = np.flatnonzero(ends.reachable.any(axis=1)), np.flatnonzero(ends.reachable.any(axis=0))
    (x, y), size = costs.origin, costs.resolution
    return (
        float(x + columns[0] * size),
        float(y + rows[0] * size),
        float(x + (columns[-1] + 1) * size),
        float(y + (rows[-1] + 1) * size),
    )
