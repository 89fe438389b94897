"""Extruded polygons: one outline becomes one solid, nested outlines become holes.

Gazebo fills several `<polyline>`s of one geometry by the even-odd rule (MeshManager::CreateExtrudedPolyline).
Outlines that lie inside or across each other are therefore cut into trapezoids between the heights of their corners
and crossings, which needs no triangulation and is exact for straight edges.
"""

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Extrusion, Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element

MOST_POINTS = 1000
TOLERANCE = 1e-9


def read_polylines(elements: list[Element]) -> tuple[Solid, ...]:
    """The solids of all `<polyline>`s of one `<geometry>`; raises Unusable for degenerate outlines."""
    heights = [values.size(element, "height") for element in elements]
    if max(heights) - min(heights) > TOLERANCE:
        raise elements[0].unusable("its polylines have different heights")
    outlines = [_outline(element) for element in elements]
    if sum(map(len, outlines)) > MOST_POINTS:
        raise elements[0].unusable(f"more than {MOST_POINTS} points")
    polygons = outlines if len(outlines) == 1 and not _crossings(outlines) else trapezoids(outlines)
    if not polygons:
        raise elements[0].unusable("the outline has no area")
    return tuple(Solid(Extrusion(tuple((float(x), float(y)) for x, y in p), heights[0])) for p in polygons)


def _outline(element: Element) -> Array:
    """The corners (n, 2) of one outline, anticlockwise, without repetitions."""
    points = np.array([values.numbers(point, 2) for point in element.all("point")]).reshape(-1, 2)
    kept = np.any(np.abs(points - np.roll(points, 1, axis=0)) > TOLERANCE, axis=1) if len(points) else []
    points = points[kept]
    if len(points) < 3:
        raise element.unusable("fewer than three points")
    if np.abs(points).max() > values.FARTHEST:
        raise element.unusable(f"farther than {values.FARTHEST:g} m")
    x, y = points.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return points if area > 0 else points[::-1]


def _edges(outlines: list[Array]) -> tuple[Array, Array]:
    return np.vstack(outlines), np.vstack([np.roll(outline, -1, axis=0) for outline in outlines])


def _crossings(outlines: list[Array]) -> list[float]:
    """The heights y at which two edges cross in their insides."""
    a, b = _edges(outlines)
    along = b - a
    between = a[None, :] - a[:, None]
    cross = along[:, None, 0] * along[None, :, 1] - along[:, None, 1] * along[None, :, 0]
    parallel = np.abs(cross) < 1e-15
    safe = np.where(parallel, 1.0, cross)
    s = (between[..., 0] * along[None, :, 1] - between[..., 1] * along[None, :, 0]) / safe
    t = (between[..., 0] * along[:, None, 1] - between[..., 1] * along[:, None, 0]) / safe
    inside = ~parallel & (s > TOLERANCE) & (s < 1 - TOLERANCE) & (t > TOLERANCE) & (t < 1 - TOLERANCE)
    rows, columns = np.nonzero(inside)
    return sorted({float(a[i, 1] + s[i, j] * along[i, 1]) for i, j in zip(rows, columns, strict=True)})


def trapezoids(outlines: list[Array]) -> list[Array]:
    """The area inside an odd number of `outlines`, cut into anticlockwise polygons (3 or 4, 2)."""
    a, b = _edges(outlines)
    levels = np.unique(np.concatenate([a[:, 1], _crossings(outlines)]))
    pieces = []
    for low, high in zip(levels[:-1].tolist(), levels[1:].tolist(), strict=True):
        if high - low > TOLERANCE:
            pieces += _band(a, b, low, high)
    return pieces


def _band(a: Array, b: Array, low: float, high: float) -> list[Array]:
    middle = (low + high) / 2
    through = (a[:, 1] < middle) != (b[:, 1] < middle)
    start, along = a[through], (b - a)[through]

    def at(level: float) -> Array:
        x: Array = start[:, 0] + (level - start[:, 1]) / along[:, 1] * along[:, 0]
        return x

    order = np.argsort(at(middle), kind="stable")
    bottom, top = at(low)[order], at(high)[order]
    pieces = []
    for left, right in zip(range(0, len(order), 2), range(1, len(order), 2), strict=True):
        corners = [(bottom[left], low), (bottom[right], low), (top[right], high), (top[left], high)]
        distinct = [c for k, c in enumerate(corners) if np.hypot(*np.subtract(c, corners[k - 1])) > TOLERANCE]
        if len(distinct) >= 3:
            pieces.append(np.array(distinct))
    return pieces
