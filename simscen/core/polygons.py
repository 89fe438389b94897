"""Points and polygons in the plane."""

import math
from collections.abc import Sequence
from itertools import combinations

from simscen.core.geometry import Pose2

Corner = tuple[float, float]

THINNEST = 1e-6
"""m; what is thinner encloses no area."""


def distance_to_polygon(point: Pose2, corners: Sequence[tuple[float, float]]) -> float:
    """Distance in metres from a point to a filled polygon; 0 inside."""
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    if holds(corners, (point.x, point.y)):
        return 0.0
    return min(distance_to_segment(point.x, point.y, a, b) for a, b in edges)


def deep_inside(pose: Pose2, corners: Sequence[Corner]) -> float:
    """Metres from the border of a polygon for a place in it; negative outside."""
    if not holds(corners, (pose.x, pose.y)):
        return -1.0
    return min(
        distance_to_segment(pose.x, pose.y, a, b) for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
    )


def flaw(ring: Sequence[Corner]) -> str | None:
    """What keeps a ring of corners from being the border of one area, as words that follow "it"; None for nothing.

    Repeated corners are one, so that a ring may be closed by its first corner.
    """
    corners = distinct(ring)
    if _thin(corners):
        return "encloses no area"
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    last = len(edges) - 1
    for (i, (a, b)), (k, (c, d)) in combinations(enumerate(edges), 2):
        meet = _folds(a, b, d) if k == i + 1 else _folds(c, d, b) if (i, k) == (0, last) else _touch(a, b, c, d)
        if meet:
            return "crosses or touches itself"
    return None


def distinct(ring: Sequence[Corner]) -> tuple[Corner, ...]:
    """The corners without those that repeat the one before."""
    return tuple(corner for k, corner in enumerate(ring) if corner != ring[k - 1])


def turn(a: Corner, b: Corner, c: Corner) -> float:
    """Twice the area of the triangle; positive when the way from a over b to c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _thin(corners: Sequence[Corner]) -> bool:
    if len(corners) < 3:
        return True
    far = max(corners, key=lambda corner: math.dist(corner, corners[0]))
    length = math.dist(far, corners[0])
    return max(abs(turn(corners[0], far, corner)) for corner in corners) < THINNEST * length


def _folds(a: Corner, b: Corner, c: Corner) -> bool:
    """Whether the way from a to b goes back on itself to c."""
    return turn(a, b, c) == 0 and (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0


def _touch(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether the segments a-b and c-d have a point in common."""
    sides = turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)
    if sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0:
        return True
    ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(side == 0 and _within(*end) for side, end in zip(sides, ends, strict=True))


def _within(a: Corner, b: Corner, point: Corner) -> bool:
    """Whether a point on the line through a and b lies between them."""
    return all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in (0, 1))


def distance_to_segment(x: float, y: float, a: tuple[float, float], b: tuple[float, float]) -> float:
    """Distance in metres from (x, y) to the segment from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    squared = dx * dx + dy * dy
    along = ((x - a[0]) * dx + (y - a[1]) * dy) / squared if squared else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(x - a[0] - along * dx, y - a[1] - along * dy)


def holds(corners: Sequence[tuple[float, float]], point: tuple[float, float]) -> bool:
    """Whether a point is inside a polygon; on its edge, either answer may come."""
    return sum(_is_left_of(point, a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)) % 2 == 1


def crosses(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether the segments a-b and c-d cross inside of both; to touch is not to cross."""
    return turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0


def _is_left_of(point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether a ray from the point along +x crosses the edge (half-open, so that corners count once)."""
    if (a[1] > point[1]) == (b[1] > point[1]):
        return False
    return point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
