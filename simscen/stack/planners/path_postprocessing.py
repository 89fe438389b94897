"""Postprocessing of planned paths: spacing, headings, smoothing, and avoidance of blocked cell corners."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.traversal_costs import TraversalCosts

SPACING_M = 0.05
"""Distance between the points of a finished path."""
SMOOTHING_PASSES, MAX_COST_RATIO = 8, 1.003
"""Passes of the smoothing, and how much the cost of the path may rise by all of them."""


def spaced(points: Array, spacing: float) -> Array:
    """Return the polyline (n, 2) with points at most `spacing` m apart. Its corners are kept."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    counts = np.maximum(1, np.ceil(lengths / spacing - 1e-9)).astype(np.int64)
    counts[lengths == 0.0] = 0
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first + 1) / np.repeat(counts, counts)
    inner = np.repeat(points[:-1], counts, axis=0) + part[:, None] * np.repeat(steps, counts, axis=0)
    return np.vstack((points[:1], inner))


def with_headings(points: Array, goal: Pose2) -> Array:
    """Return poses (n, 3): each point heads to the next, and the last one has the heading of the goal."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))


def smoothed(costs: TraversalCosts, points: Array) -> Array:
    """Return the path (n, 2) with rounded corners, as long as that costs next to nothing.

    A path that clips a blocked cell costs inf, and is only replaced by one that does not.
    """
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
"""Cells by which a path passes a corner that it would cut."""


def avoid_cell_corners(rates: TraversalCosts, points: Array) -> Array | None:
    """Return the path (n, 2) led around each blocked corner that it cut; None if more than a corner blocks it.

    The points of a path that cut any are then no further apart than the cells are wide.
    """
    if not np.isfinite(rates.at(points)).all():
        return None
    steps = np.diff(points, axis=0)
    path = points if np.hypot(*steps.T).max(initial=0.0) <= rates.resolution else spaced(points, rates.resolution)
    places = (path - rates.origin) / rates.resolution
    cells = np.floor(places)
    aslant = np.flatnonzero((cells[1:] != cells[:-1]).all(axis=1))  # no step is longer than a cell: over one edge each
    here, there = cells[aslant], cells[aslant + 1]
    corners = np.maximum(here, there)
    reached = (corners - places[aslant]) / (places[aslant + 1] - places[aslant])
    first = (reached[:, 0] < reached[:, 1])[:, None]  # over the edge on the left or right
    over = np.where(first, *_mixed(there, here))
    beside = np.where(first, *_mixed(here, there))
    cut = ~_free(rates, over)
    if not (np.isfinite(rates.at(path)).all() and _free(rates, beside[cut]).all()):
        return None
    if not cut.any():
        return points
    led = corners[cut] + CORNER_OFFSET_CELLS * np.sign(beside[cut] + 0.5 - corners[cut])
    return np.insert(path, aslant[cut] + 1, led * rates.resolution + np.array(rates.origin), axis=0)


def _mixed(one: Array, other: Array) -> tuple[Array, Array]:
    """Return the columns of the first with the rows of the second array, and the other way round."""
    return np.column_stack((one[:, 0], other[:, 1])), np.column_stack((other[:, 0], one[:, 1]))


def _free(rates: TraversalCosts, cells: Array) -> npt.NDArray[np.bool_]:
    """Return whether the robot can be in cells (n, 2), given as (column, row)."""
    columns, rows = cells.astype(np.int64).T
    return np.asarray(np.isfinite(rates.rates[rows, columns]))
