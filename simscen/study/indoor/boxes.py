"""Walls with openings and other boxes, seen from above."""

from collections.abc import Iterable, Sequence

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import Box, Solid, TriangleMesh
from simscen.worlds.meshing import fuse

HEIGHT = 1.0
"""Of everything, in m: the lidar looks along the floor."""


def boxes(rows: Iterable[Sequence[float]]) -> Array:
    """An array (n, 4) of left, bottom, right, top in m."""
    return np.array(list(rows), dtype=np.float64).reshape(-1, 4)


def wall(
    start: tuple[float, float], end: tuple[float, float], thickness: float, openings: Sequence[tuple[float, float]] = ()
) -> Array:
    """Boxes (n, 4) of a wall along x or y; `openings` are (from, to) in m along it, in order."""
    along = 0 if start[1] == end[1] else 1
    edges = [start[along], *(start[along] + edge for opening in openings for edge in opening), end[along]]
    across = start[1 - along] - thickness / 2, start[1 - along] + thickness / 2
    pieces = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 0.01]
    if along == 0:
        return boxes((a, across[0], b, across[1]) for a, b in pieces)
    return boxes((across[0], a, across[1], b) for a, b in pieces)


def mesh_of(*parts: Array) -> TriangleMesh:
    """What stands on all these boxes (n, 4)."""
    rows = np.concatenate(parts).tolist()
    return fuse(Solid(Box((r - x, t - y, HEIGHT)), Pose3((x + r) / 2, (y + t) / 2, HEIGHT / 2)) for x, y, r, t in rows)


def distance_to(rows: Array, point: Sequence[float]) -> Array:
    """How far a point is from each of the boxes (n, 4): (n,) in m, 0 inside."""
    x, y = point
    away: Array = np.hypot(
        np.maximum(0, np.maximum(rows[:, 0] - x, x - rows[:, 2])),
        np.maximum(0, np.maximum(rows[:, 1] - y, y - rows[:, 3])),
    )
    return away
