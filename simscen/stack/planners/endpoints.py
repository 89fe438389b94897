"""Start and goal of a path search: checks that both are free, and moves them to free cells nearby if necessary."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import label

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.planners.path_postprocessing import densify
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import NavigationFailure

MAX_ESCAPE_M = 0.5
"""Maximum distance by which a start too close to an obstacle is moved."""


@dataclass(frozen=True, eq=False)
class Endpoints:
    """Start and goal (x, y) in m of a search, moved to free cells if necessary.

    `reachable` (height, width) is the mask of the free cells that are connected with the start.
    """

    start: tuple[float, float]
    goal: tuple[float, float]
    reachable: npt.NDArray[np.bool_]


def find_endpoints(costs: TraversalCosts, start: Pose2, goal: Pose2, tolerance: float) -> Endpoints:
    """Return the start and goal of the search.

    A start too close to an obstacle is moved to the nearest free point that a straight line without obstacles connects
    with the start. An unreachable goal is moved to the nearest reachable point within `tolerance` m. Raises
    NavigationFailure with START_OUTSIDE_MAP, GOAL_OUTSIDE_MAP, START_OCCUPIED, GOAL_OCCUPIED, or NO_VALID_PATH.
    """
    _raise_if_blocked(costs, start, ErrorCode.START_OUTSIDE_MAP, ErrorCode.START_OCCUPIED, "start")
    _raise_if_blocked(costs, goal, ErrorCode.GOAL_OUTSIDE_MAP, ErrorCode.GOAL_OCCUPIED, "goal")
    free = costs.free
    near_start = free_points(costs, free, start, MAX_ESCAPE_M)
    free_start = next((point for point in near_start if _is_line_free(costs, start, point)), None)
    if free_start is None:
        raise NavigationFailure(ErrorCode.START_OCCUPIED, f"no free cell within {MAX_ESCAPE_M} m of the start")
    if next(free_points(costs, free, goal, tolerance), None) is None:
        raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"no free cell within {tolerance} m of the goal")
    reachable = reachable_cells(costs, free_start)
    free_goal = next(free_points(costs, reachable, goal, tolerance), None)
    if free_goal is None:
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, "start and goal are not connected")
    return Endpoints(free_start, free_goal, reachable)


def reachable_cells(costs: TraversalCosts, start: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Return the mask (height, width) of the free cells that are connected with `start`, which must be free."""
    regions, _ = label(costs.free)
    return np.asarray(regions == regions[costs.cell(start)])


def _raise_if_blocked(costs: TraversalCosts, pose: Pose2, outside: ErrorCode, occupied: ErrorCode, name: str) -> None:
    """Raise the error `outside` if a pose is outside the map, or `occupied` if it is in an obstacle."""
    row, column = costs.cell((pose.x, pose.y))
    if not (0 <= row < costs.height and 0 <= column < costs.width):
        raise NavigationFailure(outside, f"{name} ({pose.x:.2f}, {pose.y:.2f}) is outside the map")
    if costs.costmap.distance[row, column] == 0.0:
        raise NavigationFailure(occupied, f"{name} ({pose.x:.2f}, {pose.y:.2f}) is in an obstacle")


def free_points(
    costs: TraversalCosts, free: npt.NDArray[np.bool_], pose: Pose2, max_distance: float
) -> Iterator[tuple[float, float]]:
    """Yield the position of `pose` if its cell is free, then the centers of free cells, nearest first.

    `free` (height, width) is the mask of the free cells. Cells farther away than `max_distance` m are left out.
    """
    row, column = costs.cell((pose.x, pose.y))
    if free[row, column]:
        yield pose.x, pose.y
    reach = math.ceil(max_distance / costs.resolution)
    top, left = max(0, row - reach), max(0, column - reach)
    cells = np.argwhere(free[top : row + reach + 1, left : column + reach + 1]) + np.array((top, left))
    x = costs.origin[0] + (cells[:, 1] + 0.5) * costs.resolution
    y = costs.origin[1] + (cells[:, 0] + 0.5) * costs.resolution
    distance = np.hypot(x - pose.x, y - pose.y)
    for nearest in np.argsort(distance, kind="stable").tolist():
        if distance[nearest] > max_distance:
            return
        yield float(x[nearest]), float(y[nearest])


def _is_line_free(costs: TraversalCosts, start: Pose2, point: tuple[float, float]) -> bool:
    """Return whether no obstacle is on the line from the start to a point (x, y)."""
    line = densify(np.array([(start.x, start.y), point]), 0.5 * costs.resolution)
    columns, rows = np.floor((line - costs.origin) / costs.resolution).astype(np.int64).T
    return bool((costs.costmap.distance[rows, columns] > 0.0).all())


def reachable_bounds(costs: TraversalCosts, ends: Endpoints) -> tuple[float, float, float, float]:
    """Return the bounding box (min x, min y, max x, max y) in m of the reachable cells."""
    rows, columns = np.flatnonzero(ends.reachable.any(axis=1)), np.flatnonzero(ends.reachable.any(axis=0))
    (x, y), size = costs.origin, costs.resolution
    return (
        float(x + columns[0] * size),
        float(y + rows[0] * size),
        float(x + (columns[-1] + 1) * size),
        float(y + (rows[-1] + 1) * size),
    )
