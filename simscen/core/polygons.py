"""Points and polygons in the plane."""

import math
from collections.abc import Sequence

from simscen.core.geometry import Pose2


def distance_to_polygon(point: Pose2, corners: Sequence[tuple[float, float]]) -> float:
    """Distance in metres from a point to a filled polygon; 0 inside."""
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    if sum(_crosses(point, a, b) for a, b in edges) % 2:
        return 0.0
    return min(distance_to_segment(point.x, point.y, a, b) for a, b in edges)


def distance_to_segment(x: float, y: float, a: tuple[float, float], b: tuple[float, float]) -> float:
    """Distance in metres from (x, y) to the segment from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    squared = dx * dx + dy * dy
    along = ((x - a[0]) * dx + (y - a[1]) * dy) / squared if squared else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(x - a[0] - along * dx, y - a[1] - along * dy)


def _crosses(point: Pose2, a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether a ray from the point along +x crosses the edge (half-open, so that corners count once)."""
    if (a[1] > point.y) == (b[1] > point.y):
        return False
    return point.x < a[0] + (point.y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
