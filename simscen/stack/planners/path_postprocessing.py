"""Postprocessing of planned paths: adds points and headings, smooths paths, and avoids corners of blocked cells."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.traversal_costs import TraversalCosts

SPACING_M = 0.05
"""Maximum distance between the points of a finished path."""
SMOOTHING_PASSES, MAX_COST_RATIO = 8, 1.003
"""Maximum number of smoothing passes, and maximum ratio of the costs after and before smoothing."""


def densify(points: Array, spacing: float) -> Array:
    """Return the polyline (n, 2) with points at most `spacing` m apart, and without repeated points."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    counts = np.maximum(1, np.ceil(lengths / spacing - 1e-9)).astype(np.int64)
    counts[lengths == 0.0] = 0
    first = np.repeat(np.cumsum(counts) - counts, counts)
    fraction = (np.arange(counts.sum()) - first + 1) / np.repeat(counts, counts)
    inner = np.repeat(points[:-1], counts, axis=0) + fraction[:, None] * np.repeat(steps, counts, axis=0)
    return np.vstack((points[:1], inner))


def with_headings(points: Array, goal: Pose2) -> Array:
    """Return poses (n, 3) at points (n, 2): each heads to the next point, the last pose has the heading of the goal."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))


def smoothed(costs: TraversalCosts, points: Array) -> Array:
    """Return the path (n, 2) with rounded corners, as long as it is not blocked and the cost hardly increases."""
    cost = costs.along(points)
    for _ in range(SMOOTHING_PASSES):
        other = points.copy()
        other[1:-1] += 0.5 * (0.5 * (points[:-2] + points[2:]) - points[1:-1])
        new_cost = costs.along(other)
        if math.isinf(new_cost) or new_cost > MAX_COST_RATIO * cost:
            break
        points, cost = other, new_cost if math.isinf(cost) else cost
    return points


CORNER_OFFSET_CELLS = 0.02
"""Distance in cells at which a path passes the corner of a blocked cell."""


def avoid_cell_corners(costs: TraversalCosts, points: Array) -> Array | None:
    """Return the path (n, 2) with detours around the corners of blocked cells that it cuts.

    Return None if the path crosses more of a blocked cell than a corner.
    """
    if not np.isfinite(costs.at(points)).all():
        return None
    steps = np.diff(points, axis=0)
    path = points if np.hypot(*steps.T).max(initial=0.0) <= costs.resolution else densify(points, costs.resolution)
    positions = (path - costs.origin) / costs.resolution
    cells = np.floor(positions)
    # No step is longer than a cell, so that it crosses at most one edge per axis.
    diagonal = np.flatnonzero((cells[1:] != cells[:-1]).all(axis=1))
    before, after = cells[diagonal], cells[diagonal + 1]
    corners = np.maximum(before, after)
    reached = (corners - positions[diagonal]) / (positions[diagonal + 1] - positions[diagonal])
    is_vertical_first = (reached[:, 0] < reached[:, 1])[:, None]  # crosses the vertical edge before the horizontal one
    beside = _cells_beside(before, after)
    crossed, opposite = np.where(is_vertical_first, *beside), np.where(is_vertical_first, *reversed(beside))
    cut = ~_free(costs, crossed)
    if not (np.isfinite(costs.at(path)).all() and _free(costs, opposite[cut]).all()):
        return None
    if not cut.any():
        return points
    detours = corners[cut] + CORNER_OFFSET_CELLS * np.sign(opposite[cut] + 0.5 - corners[cut])
    return np.insert(path, diagonal[cut] + 1, detours * costs.resolution + np.array(costs.origin), axis=0)


def _cells_beside(before: Array, after: Array) -> tuple[Array, Array]:
    """Return the two cells that share an edge with both cells of each diagonal step, all (n, 2) as (column, row).

    A step leads from `before` to `after`. The first result is in the column of `after`, the second in that of `before`.
    """
    return np.column_stack((after[:, 0], before[:, 1])), np.column_stack((before[:, 0], after[:, 1]))


def _free(costs: TraversalCosts, cells: Array) -> npt.NDArray[np.bool_]:
    """Return which of the cells (n, 2), given as (column, row), are not blocked."""
    columns, rows = cells.astype(np.int64).T
    return np.asarray(np.isfinite(costs.rates[rows, columns]))
