"""Polygons in the plane: distances, validity, decomposition into convex pieces, and path simplification.

A polygon is a sequence of corners (x, y) in m. The last corner is connected to the first one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, pairwise, product
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2

if TYPE_CHECKING:
    import numpy.typing as npt

Corner = tuple[float, float]
"""(x, y) in m."""

MIN_WIDTH_M = 1e-6
"""Minimum width of a valid polygon."""
POINT = ((0.0, 0.0),)
"""Outline that represents a robot by a point."""


def distance_to_polygon(point: Pose2, corners: Sequence[Corner]) -> float:
    """Return the distance in m from the position of a pose to a polygon; 0 inside the polygon."""
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    if polygon_contains(corners, (point.x, point.y)):
        return 0.0
    return min(distance_to_segment(point.x, point.y, a, b) for a, b in edges)


def points_in_polygon(corners: Sequence[Corner], points: Array) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the points (n, 2) that lie inside the polygon (even-odd rule)."""
    is_inside = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if ay != by:
            crosses = (ay > points[:, 1]) != (by > points[:, 1])
            is_inside ^= crosses & (points[:, 0] < ax + (points[:, 1] - ay) / (by - ay) * (bx - ax))
    return is_inside


def depth_inside_polygon(pose: Pose2, corners: Sequence[Corner]) -> float:
    """Return how far in m the position of a pose is inside a polygon: its distance to the border; -1 if outside."""
    if not polygon_contains(corners, (pose.x, pose.y)):
        return -1.0
    return min(
        distance_to_segment(pose.x, pose.y, a, b) for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
    )


def polygon_defect(ring: Sequence[Corner]) -> str | None:
    """Return why a polygon is invalid: "encloses no area" or "crosses or touches itself"; None if it is valid.

    The last corner may repeat the first one.
    """
    corners = without_repeated_corners(ring)
    if _encloses_no_area(corners):
        return "encloses no area"
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    last = len(edges) - 1
    for (i, (a, b)), (k, (c, d)) in combinations(enumerate(edges), 2):
        meet = (
            _folds_back(a, b, d)
            if k == i + 1
            else _folds_back(c, d, b)
            if (i, k) == (0, last)
            else _segments_touch(a, b, c, d)
        )
        if meet:
            return "crosses or touches itself"
    return None


def without_repeated_corners(ring: Sequence[Corner]) -> tuple[Corner, ...]:
    """Return the corners without repetitions of the previous corner."""
    return tuple(corner for k, corner in enumerate(ring) if corner != ring[k - 1])


def signed_double_area(a: Corner, b: Corner, c: Corner) -> float:
    """Return twice the signed area of the triangle; positive if a, b, c are counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


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
    sides = (
        signed_double_area(a, b, c),
        signed_double_area(a, b, d),
        signed_double_area(c, d, a),
        signed_double_area(c, d, b),
    )
    if sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0:
        return True
    ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(side == 0 and _lies_between(*end) for side, end in zip(sides, ends, strict=True))


def _lies_between(a: Corner, b: Corner, point: Corner) -> bool:
    """Return whether a point on the line through a and b lies between them."""
    return all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in (0, 1))


def distance_to_segment(x: float, y: float, a: Corner, b: Corner) -> float:
    """Return the distance in m from (x, y) to the segment from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    squared = dx * dx + dy * dy
    along = ((x - a[0]) * dx + (y - a[1]) * dy) / squared if squared else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(x - a[0] - along * dx, y - a[1] - along * dy)


def polygon_contains(corners: Sequence[Corner], point: Corner) -> bool:
    """Return whether a point is inside a polygon. Points on an edge may count either way."""
    return (
        sum(_ray_crosses_edge(point, a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)) % 2 == 1
    )


def segments_cross(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return whether the segments a-b and c-d cross in their interiors; touching does not count."""
    return (
        signed_double_area(a, b, c) * signed_double_area(a, b, d) < 0
        and signed_double_area(c, d, a) * signed_double_area(c, d, b) < 0
    )


def _ray_crosses_edge(point: Corner, a: Corner, b: Corner) -> bool:
    """Return whether a ray from the point in the direction +x crosses the edge from a to b."""
    # Only the lower end belongs to an edge, so that a ray through a corner crosses one edge.
    if (a[1] > point[1]) == (b[1] > point[1]):
        return False
    return point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])


Piece = tuple[Corner, ...]
"""Convex polygon, counterclockwise."""


def convex_pieces(ring: Sequence[Corner]) -> list[Piece]:
    """Decompose a polygon into convex counterclockwise polygons that do not overlap.

    Triangulates by ear clipping, then merges triangles (Hertel and Mehlhorn, 1983). Raises ValueError for a polygon
    that intersects itself.
    """
    corners = without_repeated_corners(ring)
    if sum(signed_double_area(corners[0], a, b) for a, b in pairwise(corners)) < 0:
        corners = corners[::-1]
    if _is_convex(corners):
        return [corners]
    return _merge_triangles(_triangles(list(corners)))


def _triangles(corners: list[Corner]) -> list[Piece]:
    """Triangulate a counterclockwise polygon by ear clipping (Meisters, 1975)."""
    found: list[Piece] = []
    while len(corners) > 2:
        k = next((k for k in range(len(corners)) if _is_collinear(corners, k) or _is_ear(corners, k)), None)
        if k is None:
            raise ValueError("the polygon crosses itself")
        if not _is_collinear(corners, k):
            found.append(_triangle_at(corners, k))
        del corners[k]
    return found


def _triangle_at(corners: Sequence[Corner], k: int) -> tuple[Corner, Corner, Corner]:
    """Return the previous corner, corner k, and the next corner."""
    return corners[k - 1], corners[k], corners[(k + 1) % len(corners)]


def _is_collinear(corners: Sequence[Corner], k: int) -> bool:
    return signed_double_area(*_triangle_at(corners, k)) == 0


def _is_ear(corners: Sequence[Corner], k: int) -> bool:
    """Return whether the triangle at corner k is inside the polygon and contains no other corner."""
    a, b, c = _triangle_at(corners, k)
    if signed_double_area(a, b, c) <= 0:
        return False
    others = (corner for corner in corners if corner not in (a, b, c))
    return not any(
        signed_double_area(a, b, p) >= 0 and signed_double_area(b, c, p) >= 0 and signed_double_area(c, a, p) >= 0
        for p in others
    )


def _merge_triangles(triangles: Sequence[Piece]) -> list[Piece]:
    """Join triangles with a common edge as long as the results are convex (Hertel and Mehlhorn)."""
    pieces = dict(enumerate(triangles))
    owner = {edge: number for number, piece in pieces.items() for edge in _edges(piece)}
    for a, b in list(owner):
        one, other = owner.get((a, b)), owner.get((b, a))
        if one is None or other is None or one == other:
            continue
        joined = (*_rotated_to(pieces[one], b)[:-1], *_rotated_to(pieces[other], a)[:-1])
        if _is_convex(joined):
            pieces[one] = joined
            owner |= dict.fromkeys(_edges(pieces.pop(other)), one)
            del owner[a, b], owner[b, a]
    return list(pieces.values())


def _edges(piece: Piece) -> list[tuple[Corner, Corner]]:
    return list(zip(piece, (*piece[1:], piece[0]), strict=True))


def _rotated_to(piece: Piece, corner: Corner) -> Piece:
    """Return the same polygon, starting with `corner`."""
    k = piece.index(corner)
    return (*piece[k:], *piece[:k])


def _is_convex(corners: Sequence[Corner]) -> bool:
    """Return whether a counterclockwise polygon is convex. A pentagram is not, because it winds around twice."""
    turns = 0.0
    for before, corner, after in (_triangle_at(corners, k) for k in range(len(corners))):
        double_area = signed_double_area(before, corner, after)
        if double_area < 0:
            return False
        step, next_step = (corner[0] - before[0], corner[1] - before[1]), (after[0] - corner[0], after[1] - corner[1])
        turns += math.atan2(double_area, step[0] * next_step[0] + step[1] * next_step[1]) / (2 * math.pi)
    return turns < 1.5


def separation(poses: Array, moving: Sequence[Corner], fixed: Sequence[Corner]) -> Array:
    """Return the signed distance (n,) in m of the polygon `moving`, placed at `poses` (n, 3), from the polygon `fixed`.

    If the polygons overlap, the distance is negative: minus the length of the shortest translation that separates them.
    For concave polygons, this length is only a lower bound. `moving` may be a single point. Raises ValueError for a
    polygon that intersects itself.
    """
    pieces = [_array(piece) for piece in (convex_pieces(moving) if len(moving) > 2 else [moving])]
    others = [_array(piece) for piece in convex_pieces(fixed)]
    found = np.full(len(poses), np.inf)
    for piece, other in product(pieces, others):
        middle = other.mean(axis=0)
        reach = np.hypot(*piece.T).max() + np.hypot(*(other - middle).T).max()
        near = np.flatnonzero(np.hypot(*(poses[:, :2] - middle).T) - reach < found)
        still = np.broadcast_to(other, (len(near), *other.shape))
        found[near] = np.minimum(found[near], _convex_separation(_transformed_corners(poses[near], piece), still))
    return found


POSES_PER_BATCH = 64
"""Number of consecutive poses that share one search for nearby boxes."""


def separation_from_boxes(poses: Array, moving: Sequence[Corner], boxes: Array) -> Array:
    """Return the signed distance (n,) in m of the polygon `moving`, placed at `poses` (n, 3), from the nearest box.

    The sign is that of `separation`. `boxes` (m, 4) are rectangles as min x, min y, max x, max y in m. The result is
    inf without boxes.
    """
    pieces = [_array(piece) for piece in (convex_pieces(moving) if len(moving) > 2 else [moving])]
    reach = max(float(np.hypot(*piece.T).max()) for piece in pieces)
    found = np.full(len(poses), np.inf)
    for begin in range(0, len(poses) if len(boxes) else 0, POSES_PER_BATCH):
        here = poses[begin : begin + POSES_PER_BATCH]
        middle = here[:, :2].mean(axis=0)
        spread = float(np.hypot(*(here[:, :2] - middle).T).max())
        around = boxes[_can_be_nearest(middle[np.newaxis], boxes, spread + reach)[0]]
        pose, box = np.nonzero(_can_be_nearest(here[:, :2], around, reach))
        corners = around[box][:, [[0, 1], [2, 1], [2, 3], [0, 3]]]
        for piece in pieces:
            np.minimum.at(found, begin + pose, _convex_separation(_transformed_corners(here[pose], piece), corners))
    return found


def _can_be_nearest(points: Array, boxes: Array, reach: float) -> npt.NDArray[np.bool_]:
    """Return a mask (n, m) of the boxes (m, 4) that can be nearest to a polygon around each of the points (n, 2).

    The corners of the polygon are within `reach` m of the point.
    """
    beside = np.maximum(boxes[:, :2] - points[:, np.newaxis], points[:, np.newaxis] - boxes[:, 2:])
    outside = np.maximum(beside, 0.0)
    gaps = np.hypot(outside[..., 0], outside[..., 1])
    nearest: npt.NDArray[np.bool_] = gaps <= gaps.min(axis=1, keepdims=True) + 2 * reach + 1e-9
    return nearest


def _array(corners: Sequence[Corner]) -> Array:
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def _transformed_corners(poses: Array, corners: Array) -> Array:
    """Return the corners (h, 2) of a polygon at each of the `poses` (n, 3), as (n, h, 2)."""
    c, s = np.cos(poses[:, 2])[:, np.newaxis], np.sin(poses[:, 2])[:, np.newaxis]
    turned = np.stack((c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]), axis=2)
    placed: Array = turned + poses[:, np.newaxis, :2]
    return placed


def _convex_separation(moving: Array, still: Array) -> Array:
    """Return the signed distances (n,) of n pairs of convex counterclockwise polygons, (n, h, 2) and (n, r, 2).

    By the separating axis theorem, convex polygons overlap if they overlap along all edge normals. The smallest of
    these overlaps is the length of the shortest translation that separates them.
    """
    along = np.maximum(_separation_along_normals(still, moving), _separation_along_normals(moving, still))
    apart = np.minimum(_distance_to_border(moving, still), _distance_to_border(still, moving))
    signed: Array = np.where(along > 0, apart, along)
    return signed


def _separation_along_normals(polygon: Array, points: Array) -> Array:
    """Return the largest gap (n,) in m between polygons (n, m, 2) and points (n, k, 2) along an edge normal.

    The gap at an edge is the smallest signed distance of the points from the line of the edge; negative inside.
    """
    if polygon.shape[1] < 2:
        return np.full(len(points), -np.inf)
    along = np.roll(polygon, -1, axis=1) - polygon
    outward = np.stack((along[..., 1], -along[..., 0]), axis=2) / np.hypot(*np.moveaxis(along, 2, 0))[..., np.newaxis]
    offset = np.einsum("nkj,nmj->nmk", points, outward) - np.einsum("nmj,nmj->nm", polygon, outward)[..., np.newaxis]
    furthest: Array = offset.min(axis=2).max(axis=1)
    return furthest


def _distance_to_border(points: Array, polygon: Array) -> Array:
    """Return the smallest distance (n,) in m of points (n, k, 2) from the borders of polygons (n, m, 2)."""
    along = np.roll(polygon, -1, axis=1) - polygon
    squared = np.maximum((along**2).sum(axis=2), np.finfo(np.float64).tiny)[:, np.newaxis]
    offset = points[:, :, np.newaxis] - polygon[:, np.newaxis]
    share = np.clip(np.einsum("nkmj,nmj->nkm", offset, along) / squared, 0.0, 1.0)
    gap = offset - share[..., np.newaxis] * along[:, np.newaxis]
    distance: Array = np.hypot(gap[..., 0], gap[..., 1]).min(axis=(1, 2))
    return distance


def path_corners(path: Array, tolerance: float) -> list[int]:
    """Simplify a path (n, 2) to straight lines. Return the indices of the corners between them.

    The path deviates from the lines by at most `tolerance` m. Source: Douglas and Peucker, Algorithms for the reduction
    of the number of points (1973).
    """
    line, offsets = path[-1] - path[0], path - path[0]
    along = np.clip(offsets @ line / max(float(line @ line), 1e-9), 0.0, 1.0)
    away = np.hypot(*(offsets - along[:, None] * line).T)
    bend = int(np.argmax(away))
    if away[bend] <= tolerance or bend in (0, len(path) - 1):
        return []
    after = [bend + index for index in path_corners(path[bend:], tolerance)]
    return [*path_corners(path[: bend + 1], tolerance), bend, *after]
