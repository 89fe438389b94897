"""Optimization of a path on traversal costs.

The optimization places stations along the path, and several points to the left and right of each station. Viterbi's
algorithm finds the cheapest path through one point per station. The path usually stays on the same side of each
obstacle.
"""

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.polylines import resample_polyline
from simscen.stack.planners.path_postprocessing import smooth_path
from simscen.stack.planners.traversal_costs import SAMPLE_SPACING_CELLS, TraversalCosts

REFINEMENT_ROUNDS = ((0.3, 0.4, 9), (0.3, 0.2, 9), (0.25, 0.12, 7), (0.2, 0.06, 7))
"""Rounds of `refine`: distance between stations in m, maximum offset from a station in m, and points per station."""
MIN_SEGMENTS = 2
"""Minimum number of segments of a path, so that there is a station between its ends."""
Costs = npt.NDArray[np.float32]
"""Array of traversal costs."""


def refine(costs: TraversalCosts, points: Array) -> Array:
    """Return an optimized and smoothed path near a path (n, 2), with the same ends."""
    points = _with_shortcuts(costs, points)
    cost = costs.along(points)
    for spacing, max_offset, count in REFINEMENT_ROUNDS:
        for stride in (costs.stride, SAMPLE_SPACING_CELLS * costs.resolution):
            candidate = _cheapest_through(
                costs,
                resample_polyline(points, spacing, MIN_SEGMENTS),
                np.linspace(-max_offset, max_offset, count),
                stride,
            )
            if math.isfinite(new_cost := costs.along(candidate)):
                break
        if new_cost < cost:
            points, cost = candidate, new_cost
    return smooth_path(costs, points)


def _with_shortcuts(costs: TraversalCosts, points: Array) -> Array:
    """Return the path with straight shortcuts wherever a shortcut is not more expensive."""
    resampled = resample_polyline(points, REFINEMENT_ROUNDS[0][0], MIN_SEGMENTS)
    rows = resampled.tolist()
    cost = [0.0]
    for (ax, ay), (bx, by) in pairwise(rows):
        cost.append(cost[-1] + costs.between(ax, ay, bx, by))
    if not math.isfinite(cost[-1]):
        return points
    corners, last = [0], len(rows) - 1
    while corners[-1] < last:
        current = corners[-1]
        reachable, step = current + 1, 2
        while reachable < last:
            candidate = min(current + step, last)
            if costs.between(*rows[current], *rows[candidate]) > cost[candidate] - cost[current] + 1e-9:
                break
            reachable, step = candidate, 2 * step
        corners.append(reachable)
    return resampled[corners]


def _cheapest_through(costs: TraversalCosts, stations: Array, offsets: Array, stride: float) -> Array:
    """Return the cheapest path through one point per station, by Viterbi's algorithm.

    The points are at `offsets` m to the left of the stations (n, 2). The first and the last station have no offset.
    Costs are sampled every `stride` m.
    """
    direction = np.empty_like(stations)
    direction[1:-1] = stations[2:] - stations[:-2]
    direction[0], direction[-1] = stations[1] - stations[0], stations[-1] - stations[-2]
    direction /= np.maximum(np.hypot(direction[:, 0], direction[:, 1]), 1e-9)[:, None]
    left = np.column_stack((-direction[:, 1], direction[:, 0]))
    segment_costs = _step_costs(costs, stations[:, None] + offsets[:, None] * left[:, None], stride)
    middle = len(offsets) // 2
    lowest = np.full(len(offsets), np.inf, dtype=np.float32)
    lowest[middle] = 0.0
    predecessors, columns = [], np.arange(len(offsets))
    for step in segment_costs:
        total = lowest[:, None] + step
        predecessors.append(total.argmin(axis=0))
        lowest = total[predecessors[-1], columns]
    chosen = [middle]
    for predecessor in predecessors[::-1]:
        chosen.append(int(predecessor[chosen[-1]]))
    return stations + offsets[chosen[::-1], None] * left


def _step_costs(costs: TraversalCosts, points: Array, stride: float) -> Costs:
    """Return the costs (n - 1, k, k) from each point of a station to each point of the next one.

    `points` (n, k, 2) are the k points of n stations. Costs are sampled every `stride` m.
    """
    before = ((points[:-1] - costs.origin) / costs.resolution).astype(np.float32)[:, :, None]
    step = ((points[1:] - costs.origin) / costs.resolution).astype(np.float32)[:, None] - before
    samples = math.ceil(float(np.hypot(*(points[1:, 0] - points[:-1, 0]).T).max()) / stride)
    flat, total = costs.rates.reshape(-1), np.zeros(step.shape[:-1], dtype=np.float32)
    for sample in range(samples):
        points_between = before + np.float32((sample + 0.5) / samples) * step
        columns = np.clip(points_between[..., 0], 0, costs.width - 1).astype(np.int32)
        total += flat[np.clip(points_between[..., 1], 0, costs.height - 1).astype(np.int32) * costs.width + columns]
    lengths = np.sqrt(step[..., 0] ** 2 + step[..., 1] ** 2) * np.float32(costs.resolution / samples)
    segment_costs: Costs = total * lengths
    return segment_costs
