"""Polygons in the plane: transforms, tests of points, distances, and validity.

A polygon is a sequence of corners (x, y) in m. The last corner is connected to the first one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Polygon, Pose2

if TYPE_CHECKING:
    import numpy.typing as npt

Corner = tuple[float, float]
"""(x, y) in m."""

MIN_WIDTH_M = 1e-6
"""Minimum width of a valid polygon."""


def transform_polygon(frame: Pose2, polygon: Polygon) -> Polygon:
    """Return a polygon given in `frame`, expressed in the parent frame of `frame`."""
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    return tuple((frame.x + c * x - s * y, frame.y + s * x + c * y) for x, y in polygon)


def polygon_edges(corners: Sequence[Corner]) -> list[tuple[Corner, Corner]]:
    """Return the start and end of each edge."""
    return list(zip(corners, (*corners[1:], corners[0]), strict=True))


def polygon_contains(corners: Sequence[Corner], point: Corner) -> bool:
    """Return whether a point is inside a polygon (even-odd rule). Points on an edge may count either way."""
    x, y = point
    is_inside = False
    for (ax, ay), (bx, by) in polygon_edges(corners):
        # Only the lower end belongs to an edge, so that a ray through a corner crosses one edge.
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            is_inside = not is_inside
    return is_inside


def points_in_polygon(corners: Sequence[Corner], points: Array) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the points (n, 2) that lie inside the polygon (even-odd rule)."""
    is_inside = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in polygon_edges(corners):
        if ay != by:
            crosses = (ay > points[:, 1]) != (by > points[:, 1])
            is_inside ^= crosses & (points[:, 0] < ax + (points[:, 1] - ay) / (by - ay) * (bx - ax))
    return is_inside


def distance_to_polygon(point: Pose2, corners: Sequence[Corner]) -> float:
    """Return the distance in m from the position of the pose `point` to a polygon; 0 inside the polygon."""
    return 0.0 if polygon_contains(corners, (point.x, point.y)) else _distance_to_border(point, corners)


def depth_inside_polygon(pose: Pose2, corners: Sequence[Corner]) -> float:
    """Return the distance in m from the position of a pose inside a polygon to the border; -1 outside the polygon."""
    return _distance_to_border(pose, corners) if polygon_contains(corners, (pose.x, pose.y)) else -1.0


def _distance_to_border(pose: Pose2, corners: Sequence[Corner]) -> float:
    return min(distance_to_segment(pose.x, pose.y, a, b) for a, b in polygon_edges(corners))


def distance_to_segment(x: float, y: float, a: Corner, b: Corner) -> float:
    """Return the distance in m from (x, y) to the segment from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    squared = dx * dx + dy * dy
    along = ((x - a[0]) * dx + (y - a[1]) * dy) / squared if squared else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(x - a[0] - along * dx, y - a[1] - along * dy)


def inscribed_radius(polygon: Sequence[Corner]) -> float:
    """Return the radius in m of the largest circle around the origin inside a polygon that contains the origin."""
    return min(distance_to_segment(0.0, 0.0, a, b) for a, b in polygon_edges(polygon))


def signed_double_area(a: Corner, b: Corner, c: Corner) -> float:
    """Return twice the signed area of the triangle; positive if a, b, c are counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def segments_cross(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return whether the segments a-b and c-d cross in their interiors; touching does not count."""
    return (
        signed_double_area(a, b, c) * signed_double_area(a, b, d) < 0
        and signed_double_area(c, d, a) * signed_double_area(c, d, b) < 0
    )


def polygon_defect(ring: Sequence[Corner]) -> str | None:
    """Return why a polygon is invalid: "encloses no area" or "crosses or touches itself"; None if it is valid.

    The last corner may repeat the first one.
    """
    corners = without_repeated_corners(ring)
    if _encloses_no_area(corners):
        return "encloses no area"
    edges = polygon_edges(corners)
    for (i, (a, b)), (k, (c, d)) in combinations(enumerate(edges), 2):
        if k == i + 1:
            meet = _folds_back(a, b, d)
        elif (i, k) == (0, len(edges) - 1):
            meet = _folds_back(c, d, b)
        else:
            meet = _segments_touch(a, b, c, d)
        if meet:
            return "crosses or touches itself"
    return None


def without_repeated_corners(ring: Sequence[Corner]) -> tuple[Corner, ...]:
    """Remove each corner that equals the previous corner. The last corner counts as the previous one of the first."""
    return tuple(corner for k, corner in enumerate(ring) if corner != ring[k - 1])


def _encloses_no_area(corners: Sequence[Corner]) -> bool:
    """Return whether a polygon is narrower than MIN_WIDTH_M."""
    if len(corners) < 3:
        return True
    far = max(corners, key=lambda corner: math.dist(corner, corners[0]))
    length = math.dist(far, corners[0])
    return max(abs(signed_double_area(corners[0], far, corner)) for corner in corners) < MIN_WIDTH_M * length


def _folds_back(a: Corner, b: Corner, c: Corner) -> bool:
    """Return whether the path a, b, c reverses its direction at b."""
    return signed_double_area(a, b, c) == 0 and (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0


def _segments_touch(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return whether the segments a-b and c-d have a common point."""
    if segments_cross(a, b, c, d):
        return True
    return any(
        signed_double_area(begin, end, point) == 0
        and all(min(begin[k], end[k]) <= point[k] <= max(begin[k], end[k]) for k in (0, 1))
        for begin, end, point in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    )
