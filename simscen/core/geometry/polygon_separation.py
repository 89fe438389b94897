"""Signed distances between polygons, by decomposition into convex pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import Corner, polygon_edges, signed_double_area, without_repeated_corners

if TYPE_CHECKING:
    import numpy.typing as npt

POINT = ((0.0, 0.0),)
"""Outline that represents a robot by a point."""
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
        areas = [signed_double_area(*_triangle_at(corners, k)) for k in range(len(corners))]
        k = next((k for k, area in enumerate(areas) if area == 0 or _is_ear(corners, k)), None)
        if k is None:
            raise ValueError("the polygon crosses itself")
        if areas[k] != 0:
            found.append(_triangle_at(corners, k))
        del corners[k]
    return found


def _triangle_at(corners: Sequence[Corner], k: int) -> tuple[Corner, Corner, Corner]:
    """Return the previous corner, corner k, and the next corner."""
    return corners[k - 1], corners[k], corners[(k + 1) % len(corners)]


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
    owner = {edge: number for number, piece in pieces.items() for edge in polygon_edges(piece)}
    for a, b in list(owner):
        first, second = owner.get((a, b)), owner.get((b, a))
        if first is None or second is None or first == second:
            continue
        joined = (*_starting_with(pieces[first], b)[:-1], *_starting_with(pieces[second], a)[:-1])
        if _is_convex(joined):
            pieces[first] = joined
            owner |= dict.fromkeys(polygon_edges(pieces.pop(second)), first)
            del owner[a, b], owner[b, a]
    return list(pieces.values())


def _starting_with(piece: Piece, corner: Corner) -> Piece:
    """Return the corners of the same polygon, starting with `corner`."""
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


MAX_BATCH_POSES = 1024
"""Maximum number of poses for which `separation` computes distances at once, to limit the memory."""


def separation(poses: Array, moving: Sequence[Corner], fixed: Sequence[Corner]) -> Array:
    """Return the signed distance (n,) in m of the polygon `moving`, placed at `poses` (n, 3), from the polygon `fixed`.

    The distance of overlapping polygons is the negative length of the shortest translation that separates them.
    For concave polygons, this length is only a lower bound. `moving` may be a single point. Raises ValueError for a
    polygon that intersects itself.
    """
    others = [np.array(piece, dtype=np.float64) for piece in convex_pieces(fixed)]
    found = np.full(len(poses), np.inf)
    for piece, other in product(_piece_arrays(moving), others):
        middle = other.mean(axis=0)
        reach = np.hypot(*piece.T).max() + np.hypot(*(other - middle).T).max()
        near = np.flatnonzero(np.hypot(*(poses[:, :2] - middle).T) - reach < found)
        for batch in np.array_split(near, 1 + len(near) // MAX_BATCH_POSES):
            placed = _transformed_corners(poses[batch], piece)
            repeated = np.broadcast_to(other, (len(batch), *other.shape))
            found[batch] = np.minimum(found[batch], _convex_separation(placed, repeated))
    return found


POSES_PER_BATCH = 64
"""Number of consecutive poses that share one search for nearby boxes."""


def separation_from_boxes(poses: Array, moving: Sequence[Corner], boxes: Array) -> Array:
    """Return the signed distance (n,) in m of the polygon `moving`, placed at `poses` (n, 3), from the nearest box.

    The distance is negative for overlaps, as in `separation`. `boxes` (m, 4) are rectangles as min x, min y, max x,
    max y in m. The result is inf without boxes.
    """
    pieces = _piece_arrays(moving)
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


def _piece_arrays(moving: Sequence[Corner]) -> list[Array]:
    """Return the corners (n, 2) of each convex piece of a polygon; the point itself for a single point."""
    return [np.array(piece, dtype=np.float64) for piece in (convex_pieces(moving) if len(moving) > 2 else [moving])]


def _can_be_nearest(points: Array, boxes: Array, reach: float) -> npt.NDArray[np.bool_]:
    """Return a mask (n, m) of the boxes (m, 4) that can be nearest to a polygon around each of the points (n, 2).

    The corners of the polygon are within `reach` m of the point.
    """
    beside = np.maximum(boxes[:, :2] - points[:, np.newaxis], points[:, np.newaxis] - boxes[:, 2:])
    outside = np.maximum(beside, 0.0)
    gaps = np.hypot(outside[..., 0], outside[..., 1])
    nearest: npt.NDArray[np.bool_] = gaps <= gaps.min(axis=1, keepdims=True) + 2 * reach + 1e-9
    return nearest


def _transformed_corners(poses: Array, corners: Array) -> Array:
    """Return the corners (h, 2) of a polygon at each of the `poses` (n, 3), as (n, h, 2)."""
    c, s = np.cos(poses[:, 2])[:, np.newaxis], np.sin(poses[:, 2])[:, np.newaxis]
    turned = np.stack((c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]), axis=2)
    placed: Array = turned + poses[:, np.newaxis, :2]
    return placed


def _convex_separation(first: Array, second: Array) -> Array:
    """Return the signed distances (n,) of n pairs of convex counterclockwise polygons, (n, h, 2) and (n, r, 2).

    By the separating axis theorem, convex polygons overlap if they overlap along all edge normals. The smallest of
    these overlaps is the length of the shortest translation that separates the polygons.
    """
    gap = np.maximum(_separation_along_normals(second, first), _separation_along_normals(first, second))
    distance = np.minimum(_distance_to_border(first, second), _distance_to_border(second, first))
    signed: Array = np.where(gap > 0, distance, gap)
    return signed


def _separation_along_normals(polygon: Array, points: Array) -> Array:
    """Return the largest gap (n,) in m, over all edges, between polygons (n, m, 2) and points (n, k, 2).

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
