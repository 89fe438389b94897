"""From the points of a path to the path that is followed: smooth, evenly spaced, with headings."""

import math

import numpy as np

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
