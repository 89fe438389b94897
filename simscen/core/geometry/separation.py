"""Signed distance between polygons: separation, or penetration depth."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import Corner, convex_pieces

if TYPE_CHECKING:
    import numpy.typing as npt


def separation(poses: Array, moving: Sequence[Corner], fixed: Sequence[Corner]) -> Array:
    """Return the signed distance (n,) in m between `moving` at `poses` (n, 3) and `fixed`, both filled polygons.

    Positive values are the distance between the nearest points. Negative values are the shortest translation that would
    separate the polygons; for concave polygons, that of the pair of convex pieces with the deepest penetration, a lower
    bound. `moving` may be a single point. Raises ValueError for a polygon that intersects itself.
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
"""Number of poses that share one search for nearby boxes; consecutive poses of a drive are close together."""


def separation_from_boxes(poses: Array, moving: Sequence[Corner], boxes: Array) -> Array:
    """Return `separation` from the nearest of many rectangles (m, 4) as min x, min y, max x, max y; inf for none.

    If rectangles overlap the polygon, the deepest one counts. Only rectangles that can be the nearest are compared:
    their distance from the position of the robot differs from that of the hull by at most the radius of the hull. The
    same holds for a batch of poses and their mean position.
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
    """Return which boxes (m, 4) can be the nearest to anything within `reach` of the points (n, 2)."""
    beside = np.maximum(boxes[:, :2] - points[:, np.newaxis], points[:, np.newaxis] - boxes[:, 2:])
    outside = np.maximum(beside, 0.0)
    gaps = np.hypot(outside[..., 0], outside[..., 1])
    nearest: npt.NDArray[np.bool_] = gaps <= gaps.min(axis=1, keepdims=True) + 2 * reach + 1e-9
    return nearest


def _array(corners: Sequence[Corner]) -> Array:
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def _transformed_corners(poses: Array, corners: Array) -> Array:
    """Return corners (h, 2) of the robot frame in the world frame, (n, h, 2)."""
    c, s = np.cos(poses[:, 2])[:, np.newaxis], np.sin(poses[:, 2])[:, np.newaxis]
    turned = np.stack((c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]), axis=2)
    placed: Array = turned + poses[:, np.newaxis, :2]
    return placed


def _convex_separation(moving: Array, still: Array) -> Array:
    """Return the separation of convex counterclockwise polygons (n, h, 2) and (n, r, 2).

    By the separating axis theorem, two convex polygons overlap unless an edge of one has the other polygon outside. The
    least overlap along the edge normals is the shortest translation that separates them.
    """
    along = np.maximum(_separation_along_normals(still, moving), _separation_along_normals(moving, still))
    apart = np.minimum(_distance_to_border(moving, still), _distance_to_border(still, moving))
    signed: Array = np.where(along > 0, apart, along)
    return signed


def _separation_along_normals(polygon: Array, points: Array) -> Array:
    """Return the largest distance over the edges of `polygon` (n, m, 2) of the nearest of `points` (n, k, 2)."""
    if polygon.shape[1] < 2:
        return np.full(len(points), -np.inf)
    along = np.roll(polygon, -1, axis=1) - polygon
    outward = np.stack((along[..., 1], -along[..., 0]), axis=2) / np.hypot(*np.moveaxis(along, 2, 0))[..., np.newaxis]
    offset = np.einsum("nkj,nmj->nmk", points, outward) - np.einsum("nmj,nmj->nm", polygon, outward)[..., np.newaxis]
    furthest: Array = offset.min(axis=2).max(axis=1)
    return furthest


def _distance_to_border(points: Array, polygon: Array) -> Array:
    """Return the distance of the points (n, k, 2) to the border of `polygon` (n, m, 2)."""
    along = np.roll(polygon, -1, axis=1) - polygon
    squared = np.maximum((along**2).sum(axis=2), np.finfo(np.float64).tiny)[:, np.newaxis]
    offset = points[:, :, np.newaxis] - polygon[:, np.newaxis]
    share = np.clip(np.einsum("nkmj,nmj->nkm", offset, along) / squared, 0.0, 1.0)
    gap = offset - share[..., np.newaxis] * along[:, np.newaxis]
    distance: Array = np.hypot(gap[..., 0], gap[..., 1]).min(axis=(1, 2))
    return distance
