"""Pulling a way tight: from a chain of cells to the shortest curve on the same side of every obstacle."""

import math

import numpy as np

from simscen.core.geometry import Array
from simscen.grid_graph import resample_polyline
from simscen.worlds.routes.clearance import ClearanceField

SETTLED = 0.001
"""A round that shortens the way by less than this share is the last; a way over a lattice needs two to five."""
MOST_ROUNDS = 12
SLIDES = 24
"""Smoothing steps in each round; they reach about five points to either side, a corner's worth."""


def tighten(way: Array, field: ClearanceField, radius: float) -> Array:
    """The way (n, 2) pulled tight, so that it keeps `radius` meters from everything but for a tenth of a cell.

    Straight legs come from string pulling; between them an elastic band (Quinlan and Khatib 1993) slides the way
    onto the curves around obstacles, arcs of `radius`.
    """
    allowed = radius - 0.1 * field.grid.resolution
    for _ in range(MOST_ROUNDS):
        before = length(way)
        way = _slide(resample_polyline(_straighten(way, field, allowed), field.grid.resolution), field, radius)
        if length(way) > (1 - SETTLED) * before:
            break
    return _straighten(way, field, allowed)


def length(way: Array) -> float:
    """Meters along a way (n, 2)."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def is_clear(a: Array, b: Array, field: ClearanceField, allowed: float) -> bool:
    """Whether the straight line between two points keeps a clearance of `allowed` meters, seen twice in each cell."""
    count = 2 + math.ceil(2 * math.dist(a, b) / field.grid.resolution)
    line = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
    return bool(field.keeps(line, allowed).all())


def _straighten(way: Array, field: ClearanceField, allowed: float) -> Array:
    """Skip what can be skipped: from each point go straight to the farthest one found by doubling and halving."""
    kept, last = [0], len(way) - 1
    while kept[-1] < last:
        here = kept[-1]
        near, reach = here + 1, 2
        while near < last and is_clear(way[here], way[min(here + reach, last)], field, allowed):
            near, reach = min(here + reach, last), 2 * reach
        far = min(here + reach, last)
        while far - near > 1:
            middle = (near + far) // 2
            near, far = (middle, far) if is_clear(way[here], way[middle], field, allowed) else (near, middle)
        kept.append(near)
    return way[kept]


def _slide(way: Array, field: ClearanceField, radius: float) -> Array:
    way = way.copy()
    for _ in range(SLIDES):
        way[1:-1] = (way[:-2] + way[2:]) / 2
        way[1:-1] += field.push(way[1:-1], radius)
    return way
