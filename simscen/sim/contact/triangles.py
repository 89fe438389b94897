"""Computes distances from a point to triangles, and tests whether a surface of triangles encloses a point."""

import math

import numpy as np

from simscen.core.geometry import Array, Vector

LINE_TILT = 0.0123, 0.0271
"""Slopes dx/dz and dy/dz of the line in `encloses_along_line`.

The tilt makes it unlikely that the line hits a vertical edge, such as an edge of a wall from a map.
"""


def point_to_triangles(point: Array, corners: Array) -> Array:
    """Return the distances (n,) in m from a point (3,) to triangles (n, 3, 3)."""
    a, b, c = corners.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    edges = np.min([_distances_to_segments(point, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    length = np.linalg.norm(normal, axis=1)
    has_area = length > 0
    height = np.abs(np.sum((point - a) * normal, axis=1)) / np.where(has_area, length, 1.0)
    is_above = has_area.copy()
    for p, q in ((a, b), (b, c), (c, a)):
        is_above &= np.sum(np.cross(q - p, point - p) * normal, axis=1) >= 0
    distances: Array = np.where(is_above, height, edges)
    return distances


def _distances_to_segments(point: Array, start: Array, end: Array) -> Array:
    """Return the distances (n,) in m from a point (3,) to the segments from `start` (n, 3) to `end` (n, 3)."""
    direction = end - start
    squared = np.sum(direction * direction, axis=1)
    share = np.sum((point - start) * direction, axis=1) / np.where(squared > 0, squared, 1.0)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * direction
    distances: Array = np.linalg.norm(point - nearest, axis=1)
    return distances


def encloses(corners: Array, point: Vector) -> bool:
    """Return whether a surface of triangles (n, 3, 3), counterclockwise from outside, encloses a point.

    True if the winding number exceeds one half, so that small holes have no effect. The winding number is the sum of
    the solid angles of all triangles divided by 4 pi (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983).
    """
    ax, ay, az, bx, by, bz, cx, cy, cz = np.ascontiguousarray(corners.reshape(-1, 9).T) - np.tile(point, 3)[:, None]
    la, lb, lc = (np.sqrt(x * x + y * y + z * z) for x, y, z in ((ax, ay, az), (bx, by, bz), (cx, cy, cz)))
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(angles.sum() > 2 * math.pi)


def encloses_along_line(corners: Array, point: Vector) -> bool | None:
    """Return whether a surface encloses a point, judged by its crossings with a line through the point.

    `corners` (n, 3, 3) must contain all triangles that the line may cross. The line has the slopes LINE_TILT. Returns
    None if the result is undecided, because the surface has a hole or the line hits an edge.
    """
    x, y, z = np.moveaxis(corners - point, 2, 0)
    x, y = x - LINE_TILT[0] * z, y - LINE_TILT[1] * z
    # Seen along the line, the line is a point. For each corner: twice the signed area of the triangle of this point
    # and the two other corners. All three areas have one sign if the line crosses the triangle of the corners.
    areas = np.roll(x, -1, 1) * np.roll(y, -2, 1) - np.roll(x, -2, 1) * np.roll(y, -1, 1)
    is_crossed = (areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)
    areas, z = areas[is_crossed], z[is_crossed]
    if not areas.all():
        return None
    facing, is_above = np.sign(areas[:, 0]), (areas * z).sum(axis=1) * areas[:, 0] > 0
    up, down = facing[is_above].sum(), -facing[~is_above].sum()
    return bool(up > 0) if up == down else None
