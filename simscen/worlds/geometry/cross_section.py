"""Horizontal cross sections of meshes, and the horizontal distance from a point to a mesh.

A cross section is what a level lidar at that height can see.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh


@dataclass(frozen=True, eq=False)
class CrossSection:
    """Directed segments (n, 2, 2) in meters with the solid on their left, and the number (n,) of each one's solid."""

    segments: Array
    owners: npt.NDArray[np.int32]


def section_segments(mesh: TriangleMesh, height: float) -> Array:
    """Return the segments (n, 2, 2) of the cross section at `height`; [k, 0] is the start of segment k."""
    return cross_section(mesh, height).segments


def cross_section(mesh: TriangleMesh, height: float) -> CrossSection:
    """Cut the mesh at `height`; the segments form closed loops wherever the mesh is closed.

    A vertex at exactly `height` counts as above it. A box is therefore cut from its underside (excluded) to its top
    (included), and no cut is a single point or a whole face. Two triangles that share an edge compute the same point,
    bit for bit, because both follow the edge upwards.
    """
    above = mesh.vertices[:, 2] >= height
    count_above = above[mesh.faces].sum(axis=1)
    is_cut = (count_above == 1) | (count_above == 2)
    faces, is_tip_above = mesh.faces[is_cut], count_above[is_cut] == 1
    tip_corner = np.argmax(above[faces] == is_tip_above[:, None], axis=1)
    tip_first = faces[np.arange(len(faces))[:, None], (tip_corner[:, None] + np.arange(3)) % 3]
    tip, left, right = mesh.vertices[tip_first].swapaxes(0, 1)
    first, second = _edge_crossing(tip, left, height, is_tip_above), _edge_crossing(tip, right, height, is_tip_above)
    segments = np.where(is_tip_above[:, None, None], np.stack((first, second), 1), np.stack((second, first), 1))
    has_length = np.any(segments[:, 0] != segments[:, 1], axis=1)
    return CrossSection(segments[has_length], mesh.owners[is_cut][has_length])


def _edge_crossing(tip: Array, base: Array, height: float, is_tip_above: npt.NDArray[np.bool_]) -> Array:
    """Return the points (n, 2) where the edges between `tip` (n, 3) and `base` (n, 3) pass the height."""
    low, high = np.where(is_tip_above[:, None], base, tip), np.where(is_tip_above[:, None], tip, base)
    share = (height - low[:, 2]) / (high[:, 2] - low[:, 2])
    point: Array = low[:, :2] + share[:, None] * (high - low)[:, :2]
    return point


def horizontal_distance(
    mesh: TriangleMesh, point: tuple[float, float], z_range: tuple[float, float], within: float = math.inf
) -> float:
    """Return the distance in meters from a point to the mesh between two heights, seen from above; 0 inside.

    Returns inf if the mesh has nothing between these heights, or nothing nearer than `within`.
    """
    low, high = z_range
    bottom, top = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    if bottom >= high or top <= low:
        return math.inf
    middle = (max(bottom, low) + min(top, high)) / 2
    if winds_around(section_segments(mesh, middle), point):
        return 0.0
    corners, valid = _clip_to_heights(_triangles_near(mesh, point, within), low, high)
    corners, valid = corners[valid.any(axis=1)] - point, valid[valid.any(axis=1)]
    if not len(corners):
        return math.inf
    return 0.0 if _contains_origin(corners, valid).any() else _distance_from_origin(corners, valid)


def _triangles_near(mesh: TriangleMesh, point: tuple[float, float], distance: float) -> Array:
    """Return the triangles (m, 3, 3) whose bounding rectangle is at most `distance` away from the point."""
    triangles = mesh.vertices[mesh.faces]
    corners = triangles[:, :, :2] - point
    is_near = np.all((corners.min(axis=1) <= distance) & (corners.max(axis=1) >= -distance), axis=1)
    near: Array = triangles[is_near]
    return near


def winds_around(segments: Array, point: tuple[float, float]) -> bool:
    """Return whether segments (n, 2, 2) wind anticlockwise around a point, counted both towards +x and towards -x.

    For closed outlines both counts are equal. For meshes with holes, a single count would report points outside.
    """
    (x0, y0), (x1, y1) = segments[:, 0].T - np.array(point)[:, None], segments[:, 1].T - np.array(point)[:, None]
    crosses = (y0 > 0) != (y1 > 0)
    x0, y0, x1, y1 = x0[crosses], y0[crosses], x1[crosses], y1[crosses]
    is_towards_positive_x = x0 - y0 * (x1 - x0) / (y1 - y0) > 0
    direction = np.where(y1 > y0, 1, -1)
    return bool(direction[is_towards_positive_x].sum() > 0 and -direction[~is_towards_positive_x].sum() > 0)


def _clip_to_heights(triangles: Array, low: float, high: float) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Clip triangles (m, 3, 3) to the slab between two heights; return corners (m, 9, 2) and which of them are valid.

    A clipped triangle is convex. It is the hull of its own corners in the slab and of the points where its edges pass
    the two faces of the slab.
    """
    z = triangles[:, :, 2]
    corners, valid = [triangles[:, :, :2]], [(z >= low) & (z <= high)]
    ends, end_z = np.roll(triangles, -1, axis=1)[:, :, :2], np.roll(z, -1, axis=1)
    for height in (low, high):
        crosses = (z > height) != (end_z > height)
        share = (height - z) / np.where(crosses, end_z - z, 1.0)
        corners.append(triangles[:, :, :2] + share[:, :, None] * (ends - triangles[:, :, :2]))
        valid.append(crosses)
    return np.concatenate(corners, axis=1), np.concatenate(valid, axis=1)


def _contains_origin(corners: Array, valid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which convex hulls of corners (m, 9, 2) contain the origin: no angle between corners reaches 180°."""
    angles = np.where(valid, np.arctan2(corners[:, :, 1], corners[:, :, 0]), np.nan)
    angles = np.sort(angles, axis=1)
    last = np.nanmax(angles, axis=1) - 2 * math.pi
    gaps = np.diff(np.column_stack((last, angles)), axis=1)
    is_inside: npt.NDArray[np.bool_] = np.nanmax(gaps, axis=1) < math.pi - 1e-9
    return is_inside


def _distance_from_origin(corners: Array, valid: npt.NDArray[np.bool_]) -> float:
    """Return the distance to the nearest convex hull; none contains the origin, so the nearest point is on an edge."""
    first, second = np.triu_indices(corners.shape[1])
    both_valid = valid[:, first] & valid[:, second]
    a, b = corners[:, first][both_valid], corners[:, second][both_valid]
    edge = b - a
    squared_length = np.einsum("ij,ij->i", edge, edge)
    share = np.clip(-np.einsum("ij,ij->i", a, edge) / np.where(squared_length > 0, squared_length, 1.0), 0.0, 1.0)
    return float(np.sqrt(np.min(np.sum((a + share[:, None] * edge) ** 2, axis=1))))
