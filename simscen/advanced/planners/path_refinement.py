"""Refinement of a path to the cheapest one nearby: shortcuts, then dynamic programming with ever finer steps.

At each of several stations along the path, points are placed across it. Viterbi's algorithm finds the cheapest path
through one point of each station. The path stays on the same side of each obstacle.
"""

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.grid_graph import resample_polyline
from simscen.stack.planners.path_postprocessing import smoothed
from simscen.stack.planners.traversal_costs import SAMPLE_SPACING_CELLS, TraversalCosts

ROUNDS = ((0.3, 0.4, 9), (0.3, 0.2, 9), (0.25, 0.12, 7), (0.2, 0.06, 7))
"""Rounds of refinement: distance between stations in m, maximum offset in m, and number of points across."""
MIN_SEGMENTS = 2
"""Minimum number of segments, so that there is a station to move."""
Costs = npt.NDArray[np.float32]


def refined(rates: TraversalCosts, points: Array) -> Array:
    """Return the cheapest path near a path (n, 2) with the same ends, smoothed."""
    points = _with_shortcuts(rates, points)
    cost = rates.along(points)
    for station, side, across in ROUNDS:
        for stride in (rates.stride, SAMPLE_SPACING_CELLS * rates.resolution):
            other = _cheapest_through(
                rates, resample_polyline(points, station, MIN_SEGMENTS), np.linspace(-side, side, across), stride
            )
            if math.isfinite(moved := rates.along(other)):
                break
        if moved < cost:
            points, cost = other, moved
    return smoothed(rates, points)


def _with_shortcuts(rates: TraversalCosts, points: Array) -> Array:
    """Return the path with shortcuts: straight lines to the farthest point to which they are not more expensive."""
    places = resample_polyline(points, ROUNDS[0][0], MIN_SEGMENTS)
    rows = places.tolist()
    cost = [0.0]
    for (ax, ay), (bx, by) in pairwise(rows):
        cost.append(cost[-1] + rates.between(ax, ay, bx, by))
    if not math.isfinite(cost[-1]):
        return points
    kept, last = [0], len(rows) - 1
    while kept[-1] < last:
        here = kept[-1]
        near, step = here + 1, 2
        while near < last:
            far = min(here + step, last)
            if rates.between(*rows[here], *rows[far]) > cost[far] - cost[here] + 1e-9:
                break
            near, step = far, 2 * step
        kept.append(near)
    return places[kept]


def _cheapest_through(rates: TraversalCosts, stations: Array, offsets: Array, stride: float) -> Array:
    """Return the cheapest path through points at `offsets` m to the left of each station except the first and last.

    Costs are sampled every `stride` m.
    """
    ahead = np.empty_like(stations)
    ahead[1:-1] = stations[2:] - stations[:-2]
    ahead[0], ahead[-1] = stations[1] - stations[0], stations[-1] - stations[-2]
    ahead /= np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-9)[:, None]
    left = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    costs = _step_costs(rates, stations[:, None] + offsets[:, None] * left[:, None], stride)
    middle = len(offsets) // 2
    least = np.full(len(offsets), np.inf, dtype=np.float32)
    least[middle] = 0.0
    came, columns = [], np.arange(len(offsets))
    for step in costs:
        total = least[:, None] + step
        came.append(total.argmin(axis=0))
        least = total[came[-1], columns]
    chosen = [middle]
    for back in came[::-1]:
        chosen.append(int(back[chosen[-1]]))
    return stations + offsets[chosen[::-1], None] * left


def _step_costs(rates: TraversalCosts, points: Array, stride: float) -> Costs:
    """Return the costs (n - 1, k, k) from each point of a station to each of the next; `points` (n, k, 2)."""
    before = ((points[:-1] - rates.origin) / rates.resolution).astype(np.float32)[:, :, None]
    step = ((points[1:] - rates.origin) / rates.resolution).astype(np.float32)[:, None] - before
    samples = math.ceil(float(np.hypot(*(points[1:, 0] - points[:-1, 0]).T).max()) / stride)
    flat, total = rates.rates.reshape(-1), np.zeros(step.shape[:-1], dtype=np.float32)
    for sample in range(samples):
        at = before + np.float32((sample + 0.5) / samples) * step
        columns = np.clip(at[..., 0], 0, rates.width - 1).astype(np.int32)
        total += flat[np.clip(at[..., 1], 0, rates.height - 1).astype(np.int32) * rates.width + columns]
    lengths = np.sqrt(step[..., 0] ** 2 + step[..., 1] ** 2) * np.float32(rates.resolution / samples)
    costs: Costs = total * lengths
    return costs
