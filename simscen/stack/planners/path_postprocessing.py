"""Postprocessing of planned paths: more points, headings, smoothing, and detours around corners of blocked cells."""

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
    """Return poses (n, 3) at points (n, 2). Each pose heads to the next point, the last pose like the goal."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))


def smooth_path(costs: TraversalCosts, points: Array) -> Array:
    """Return the path (n, 2) with rounded corners. Smoothing stops before the path is blocked or costs clearly more."""
    cost = costs.along(points)
    for _ in range(SMOOTHING_PASSES):
        smoother = points.copy()
        smoother[1:-1] += 0.5 * (0.5 * (points[:-2] + points[2:]) - points[1:-1])
        new_cost = costs.along(smoother)
        if math.isinf(new_cost) or new_cost > MAX_COST_RATIO * cost:
            break
        points, cost = smoother, new_cost if math.isinf(cost) else cost
    return points


CORNER_OFFSET_CELLS = 0.02
"""Distance in cells at which a path passes the corner of a blocked cell."""


def avoid_cell_corners(costs: TraversalCosts, points: Array) -> Array | None:
    """Return the path (n, 2) with detours around the corners of blocked cells that the path cuts.

    Return None if the path crosses more of a blocked cell than a corner.
    """
    if not np.isfinite(costs.at(points)).all():
        return None
    steps = np.diff(points, axis=0)
    path = points if np.hypot(*steps.T).max(initial=0.0) <= costs.resolution else densify(points, costs.resolution)
    positions = (path - costs.origin) / costs.resolution
    cells = np.floor(positions)
    # A step is at most as long as a cell. Therefore, a step crosses at most one cell edge per axis.
    diagonal = np.flatnonzero((cells[1:] != cells[:-1]).all(axis=1))
    start_cells, end_cells = cells[diagonal], cells[diagonal + 1]
    corners = np.maximum(start_cells, end_cells)
    edge_ratios = (corners - positions[diagonal]) / (positions[diagonal + 1] - positions[diagonal])
    is_vertical_first = (edge_ratios[:, 0] < edge_ratios[:, 1])[:, None]  # the step crosses the vertical edge first
    beside = _cells_beside(start_cells, end_cells)
    crossed, opposite = np.where(is_vertical_first, *beside), np.where(is_vertical_first, *reversed(beside))
    is_cut = ~_are_free(costs, crossed)
    if not (np.isfinite(costs.at(path)).all() and _are_free(costs, opposite[is_cut]).all()):
        return None
    if not is_cut.any():
        return points
    detours = corners[is_cut] + CORNER_OFFSET_CELLS * np.sign(opposite[is_cut] + 0.5 - corners[is_cut])
    return np.insert(path, diagonal[is_cut] + 1, detours * costs.resolution + np.array(costs.origin), axis=0)


def _cells_beside(start_cells: Array, end_cells: Array) -> tuple[Array, Array]:
    """Return the two cells that share an edge with both cells of each diagonal step, all (n, 2) as (column, row).

    The first result is in the column of the end cell, the second result in the column of the start cell.
    """
    in_end_column = np.column_stack((end_cells[:, 0], start_cells[:, 1]))
    return in_end_column, np.column_stack((start_cells[:, 0], end_cells[:, 1]))


def _are_free(costs: TraversalCosts, cells: Array) -> npt.NDArray[np.bool_]:
    """Return which of the cells (n, 2), given as (column, row), are not blocked."""
    columns, rows = cells.astype(np.int64).T
    return np.asarray(np.isfinite(costs.rates[rows, columns]))
