"""From the cut of a mesh to polygons: closed rings, and simple pieces of what they enclose."""

import math

import numpy as np

from simscen.core.geometry import Array

Point = tuple[float, float]
Ring = list[Point]

STRAIGHT = 1e-6
"""Meters that a corner may stick out and still not count."""
MOST_CORNERS = 200
"""What a polygon of the world language may have."""


class OpenCut(ValueError):
    """The cut of a mesh that is not closed."""


def rings_of(segments: Array) -> list[Ring]:
    """Closed rings of directed segments (n, 2, 2), anticlockwise around solid; raises OpenCut where one ends.

    Segments of a closed mesh meet in the same bits, so points are compared exactly. Where rings touch at a corner the
    way is cut there, so that no ring visits a point twice.
    """
    ways: dict[Point, list[Point]] = {}
    for (ax, ay), (bx, by) in segments.tolist():
        ways.setdefault((ax, ay), []).append((bx, by))
    rings = []
    for start in list(ways):
        while ways[start]:
            way: dict[Point, None] = {start: None}  # a dict, because it keeps the order and knows at once what is in it
            while way:
                here = next(reversed(way))
                if not ways.get(here):
                    raise OpenCut
                here = ways[here].pop()
                if here in way:
                    points = list(way)
                    cut = points.index(here)
                    rings.append(_corners(points[cut:]))
                    way = dict.fromkeys(points[: cut + 1]) if cut else {}
                else:
                    way[here] = None
    return [ring for ring in rings if len(ring) >= 3]


def pieces_of(rings: list[Ring]) -> list[Ring]:
    """What the rings enclose as simple polygons: an outer ring without holes as it is, others in triangles."""
    outer = [ring for ring in rings if area(ring) > 0]
    holes: dict[int, list[Ring]] = {number: [] for number in range(len(outer))}
    for ring in rings:
        # The middle of an edge, because a corner may be where the hole touches the ring around it.
        middle = ((ring[0][0] + ring[1][0]) / 2, (ring[0][1] + ring[1][1]) / 2)
        around = [number for number, other in enumerate(outer) if area(ring) < 0 and _holds(other, middle)]
        if around:
            holes[min(around, key=lambda number: area(outer[number]))].append(ring)
    pieces: list[Ring] = []
    for number, ring in enumerate(outer):
        whole = not holes[number] and len(ring) <= MOST_CORNERS
        pieces += [ring] if whole else _triangles([ring, *holes[number]])
    return pieces


def area(ring: Ring) -> float:
    """Signed area in m²: positive for an anticlockwise ring."""
    x, y = np.array(ring).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _triangles(rings: list[Ring]) -> list[Ring]:
    import mapbox_earcut

    points = np.array([point for ring in rings for point in ring])
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3)
    found = [[(float(x), float(y)) for x, y in points[face]] for face in faces]
    turned = [ring if area(ring) > 0 else ring[::-1] for ring in found]
    return [ring for ring in turned if area(ring) > STRAIGHT**2]


def _corners(ring: Ring) -> Ring:
    """Without the points that triangles leave on straight edges.

    Seen from the last point that was kept, so that a round ring of short chords does not shrink to nothing.
    """
    kept: Ring = [ring[0]]
    for point, after in zip(ring[1:], [*ring[2:], ring[0]], strict=True):
        if _sticks_out(kept[-1], point, after):
            kept.append(point)
    return kept if len(kept) < 3 or _sticks_out(kept[-1], kept[0], kept[1]) else kept[1:]


def _sticks_out(before: Point, point: Point, after: Point) -> bool:
    """Whether leaving the point out would move the ring by more than STRAIGHT."""
    (ax, ay), (px, py), (bx, by) = before, point, after
    length = math.hypot(bx - ax, by - ay)
    if length < STRAIGHT:
        return True
    return abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length > STRAIGHT


def _holds(ring: Ring, point: Point) -> bool:
    """Whether a point is inside: a ray to the right crosses the ring an odd number of times."""
    x, y = point
    crossed = False
    for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]], strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            crossed = not crossed
    return crossed
