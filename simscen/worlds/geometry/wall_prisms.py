"""Walls along polylines: a prism for each straight piece, mitered where two pieces meet."""

import math
from itertools import pairwise

from simscen.core.geometry.shapes import Extrusion, Solid

Point = tuple[float, float]

SHARPEST_MITRE = -0.5
"""Cosine of the turn beyond which (120°) a miter would stick out further than the wall is thick."""


def wall_solids(points: list[Point], thickness: float, height: float, name: str) -> list[Solid]:
    """The pieces of a wall about the center line `points`; closed if the last point is the first.

    Corners up to 120° are mitered, so that pieces neither overlap nor leave a notch; at sharper ones, and where a piece
    is too short for its miters, pieces run on straight by half the thickness. Repeated points are skipped.
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
        if any(_behind(start[side], end[side], way) for side in (0, 1)):
            start, end = _run_on(a, way, thickness / 2, -1.0), _run_on(b, way, thickness / 2, 1.0)
        solids.append(Solid(Extrusion((start[1], end[1], end[0], start[0]), height), name=name))
    return solids


def _direction(a: Point, b: Point) -> Point:
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _behind(start: Point, end: Point, way: Point) -> bool:
    """Whether a side of a piece would run backwards, as its miters cross."""
    return (end[0] - start[0]) * way[0] + (end[1] - start[1]) * way[1] <= 0


def _end(corner: Point, way: Point, other: Point | None, half: float, side: float) -> tuple[Point, Point]:
    """The left and right corner of a piece at one of its ends; `side` is -1 at its start, 1 at its end."""
    (x, y), (ux, uy) = corner, way
    if other is None:
        return (x - uy * half, y + ux * half), (x + uy * half, y - ux * half)
    cosine = ux * other[0] + uy * other[1]
    if cosine < SHARPEST_MITRE:
        return _run_on(corner, way, half, side)
    left = (-uy - other[1]) * half / (1 + cosine), (ux + other[0]) * half / (1 + cosine)
    return (x + left[0], y + left[1]), (x - left[0], y - left[1])


def _run_on(corner: Point, way: Point, half: float, side: float) -> tuple[Point, Point]:
    (x, y), (ux, uy) = corner, way
    x, y = x + ux * half * side, y + uy * half * side
    return (x - uy * half, y + ux * half), (x + uy * half, y - ux * half)
