"""Walls along polylines: a prism for each straight piece, mitred where two pieces meet."""

import math
from itertools import pairwise

from simscen.core.shapes import Extrusion, Solid

Point = tuple[float, float]

SHARPEST_MITRE = -0.5
"""Cosine of the turn beyond which (120°) a mitre would stick out further than the wall is thick."""


def wall_solids(points: list[Point], thickness: float, height: float, name: str) -> list[Solid]:
    """The pieces of a wall about the centre line `points`; closed if the last point is the first.

    Corners up to 120° are mitred, so that pieces neither overlap nor leave a notch; at sharper ones both pieces run
    on by half the thickness. Repeated points are skipped.
    """
    corners = [p for k, p in enumerate(points) if k == 0 or p != points[k - 1]]
    if len(corners) < 2:
        return []
    ways = [_direction(a, b) for a, b in pairwise(corners)]
    closed = len(ways) > 1 and corners[0] == corners[-1]
    before = [ways[-1] if closed else None, *ways[:-1]]
    after = [*ways[1:], ways[0] if closed else None]
    solids = []
    for (a, b), way, previous, following in zip(pairwise(corners), ways, before, after, strict=True):
        start = _end(a, way, previous, thickness / 2, -1.0)
        end = _end(b, way, following, thickness / 2, 1.0)
        solids.append(Solid(Extrusion((start[1], end[1], end[0], start[0]), height), name=name))
    return solids


def _direction(a: Point, b: Point) -> Point:
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _end(corner: Point, way: Point, other: Point | None, half: float, side: float) -> tuple[Point, Point]:
    """The left and right corner of a piece at one of its ends; `side` is -1 at its start, 1 at its end."""
    (x, y), (ux, uy) = corner, way
    left, along = (-uy * half, ux * half), (0.0, 0.0)
    if other is not None:
        cosine = ux * other[0] + uy * other[1]
        if cosine > SHARPEST_MITRE:
            left = ((-uy - other[1]) * half / (1 + cosine), (ux + other[0]) * half / (1 + cosine))
        else:
            along = (ux * half * side, uy * half * side)
    x, y = x + along[0], y + along[1]
    return (x + left[0], y + left[1]), (x - left[0], y - left[1])
