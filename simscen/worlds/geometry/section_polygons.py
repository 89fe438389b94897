"""Convert the segments of a cross section to polygons without holes."""

import math

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import polygon_contains

Point = tuple[float, float]
"""(x, y) in m."""
Ring = list[Point]
"""Corners of a closed polygon; the first corner is not repeated at the end."""

STRAIGHTNESS_TOLERANCE_M = 1e-6
"""A corner is removed from a ring if it is at most this far from the line between its neighbors."""
MAX_CORNERS = 200
"""Maximum number of corners of a polygon in a world file."""


class OpenCrossSection(ValueError):
    """The cross section of a mesh is not closed, because the mesh has holes."""


def rings_from_segments(segments: Array) -> list[Ring]:
    """Join directed segments (n, 2, 2) to closed rings: counterclockwise outlines of solids, and clockwise holes.

    Rings that touch at a corner are separated, so that no ring visits a point twice. Raises OpenCrossSection if a ring
    is not closed.
    """
    next_points: dict[Point, list[Point]] = {}
    for (ax, ay), (bx, by) in segments.tolist():
        next_points.setdefault((ax, ay), []).append((bx, by))
    rings = []
    for start in list(next_points):
        while next_points[start]:
            path: dict[Point, None] = {start: None}  # a dict as an ordered set
            while path:
                last = next(reversed(path))
                if not next_points.get(last):
                    raise OpenCrossSection
                point = next_points[last].pop()
                if point in path:
                    points = list(path)
                    first = points.index(point)
                    rings.append(_without_straight_corners(points[first:]))
                    path = dict.fromkeys(points[: first + 1]) if first else {}
                else:
                    path[point] = None
    return [ring for ring in rings if len(ring) >= 3]


def simple_polygons(rings: list[Ring]) -> list[Ring]:
    """Return polygons without holes that cover the area that the rings enclose.

    A ring with holes, or with more than MAX_CORNERS corners, is divided into triangles.
    """
    outer_rings = [ring for ring in rings if signed_area(ring) > 0]
    holes: dict[int, list[Ring]] = {number: [] for number in range(len(outer_rings))}
    for ring in rings:
        # The middle of an edge is tested, because a corner of a hole may touch the ring around it.
        middle = ((ring[0][0] + ring[1][0]) / 2, (ring[0][1] + ring[1][1]) / 2)
        is_hole = signed_area(ring) < 0
        enclosing = [n for n, outer in enumerate(outer_rings) if is_hole and polygon_contains(outer, middle)]
        if enclosing:
            holes[min(enclosing, key=lambda n: signed_area(outer_rings[n]))].append(ring)
    polygons: list[Ring] = []
    for number, ring in enumerate(outer_rings):
        is_simple = not holes[number] and len(ring) <= MAX_CORNERS
        polygons += [ring] if is_simple else _triangles([ring, *holes[number]])
    return polygons


def signed_area(ring: Ring) -> float:
    """Return the area in m², positive for a counterclockwise ring."""
    x, y = np.array(ring).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _triangles(rings: list[Ring]) -> list[Ring]:
    """Return counterclockwise triangles that cover the outer ring `rings[0]` except its holes `rings[1:]`."""
    import mapbox_earcut

    points = np.array([point for ring in rings for point in ring])
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3)
    triangles = [[(float(x), float(y)) for x, y in points[face]] for face in faces]
    counterclockwise = [ring if signed_area(ring) > 0 else ring[::-1] for ring in triangles]
    return [ring for ring in counterclockwise if signed_area(ring) > STRAIGHTNESS_TOLERANCE_M**2]


def _without_straight_corners(ring: Ring) -> Ring:
    """Return the ring without the corners on straight edges, where two triangles of the mesh meet."""
    # Each corner is compared with the last kept one, so that a round ring of short chords keeps its shape.
    kept: Ring = [ring[0]]
    for point, following in zip(ring[1:], [*ring[2:], ring[0]], strict=True):
        if _is_corner(kept[-1], point, following):
            kept.append(point)
    return kept if len(kept) < 3 or _is_corner(kept[-1], kept[0], kept[1]) else kept[1:]


def _is_corner(before: Point, point: Point, after: Point) -> bool:
    """Return whether removing the point would move the ring by more than STRAIGHTNESS_TOLERANCE_M."""
    (ax, ay), (px, py), (bx, by) = before, point, after
    length = math.hypot(bx - ax, by - ay)
    if length < STRAIGHTNESS_TOLERANCE_M:
        return True
    return abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length > STRAIGHTNESS_TOLERANCE_M
