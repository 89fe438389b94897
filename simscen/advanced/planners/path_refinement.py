"""From a path to the cheapest one beside it: shortcuts, then dynamic programming in a tube that gets finer.

Points are set across the path at each of its stations, and Viterbi's algorithm finds the cheapest way through them all
that takes one at each. A tree's path is a few per cent from there; which side of an obstacle it passes was the tree's
choice, and stays it.
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
"""Meters between stations, meters to either side, points across."""
LEAST_LEGS = 2
"""So that there is a station to move."""
Costs = npt.NDArray[np.float32]


def refined(rates: TraversalCosts, points: Array) -> Array:
    """The path (n, 2) moved to where it costs least, with its ends kept, and smoothed."""
    points = _cut_short(rates, points)
    cost = rates.along(points)
    for station, side, across in ROUNDS:
        for stride in (rates.stride, SAMPLE_SPACING_CELLS * rates.resolution):
            other = _through(
                rates, resample_polyline(points, station, LEAST_LEGS), np.linspace(-side, side, across), stride
            )
            if math.isfinite(moved := rates.along(other)):
                break
        if moved < cost:
            points, cost = other, moved
    return smoothed(rates, points)


def _cut_short(rates: TraversalCosts, points: Array) -> Array:
    """From each kept point straight on to the farthest that it costs no more to go straight to, found by doubling."""
    places = resample_polyline(points, ROUNDS[0][0], LEAST_LEGS)
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


def _through(rates: TraversalCosts, stations: Array, offsets: Array, stride: float) -> Array:
    """The cheapest way through points at `offsets` to the left of each station but the first and last.

    Costs are looked at every `stride` meters.
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
    """What it costs (n - 1, k, k) to go from each point of one station to each of the next, given points (n, k, 2)."""
    before = ((points[:-1] - rates.origin) / rates.resolution).astype(np.float32)[:, :, None]
    step = ((points[1:] - rates.origin) / rates.resolution).astype(np.float32)[:, None] - before
    looks = math.ceil(float(np.hypot(*(points[1:, 0] - points[:-1, 0]).T).max()) / stride)
    flat, total = rates.rates.reshape(-1), np.zeros(step.shape[:-1], dtype=np.float32)
    for look in range(looks):
        at = before + np.float32((look + 0.5) / looks) * step
        columns = np.clip(at[..., 0], 0, rates.width - 1).astype(np.int32)
        total += flat[np.clip(at[..., 1], 0, rates.height - 1).astype(np.int32) * rates.width + columns]
    lengths = np.sqrt(step[..., 0] ** 2 + step[..., 1] ** 2) * np.float32(rates.resolution / looks)
    costs: Costs = total * lengths
    return costs
