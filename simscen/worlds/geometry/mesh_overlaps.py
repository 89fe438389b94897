"""Horizontal distance to a mesh between two heights, and overlaps of footprints with solids that are not prisms."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Polygon
from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.worlds.geometry.cross_section import cross_section, sections_between, winds_around
from simscen.worlds.geometry.triangulation import merge_solids

Point = tuple[float, float]
"""(x, y) in m."""


def horizontal_distance(
    mesh: TriangleMesh, point: Point, z_range: tuple[float, float], max_distance: float = math.inf
) -> float:
    """Return the horizontal distance in m from a point to the part of the mesh between two heights; 0 inside.

    Returns inf if the mesh has no part between the heights `z_range`. Distances above `max_distance` may be inf, too.
    """
    low, high = z_range
    bottom, top = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    if bottom >= high or top <= low:
        return math.inf
    middle = (max(bottom, low) + min(top, high)) / 2
    if winds_around(cross_section(mesh, middle).segments, point):
        return 0.0
    triangles = mesh.vertices[mesh.faces]
    offsets = triangles[:, :, :2] - point
    is_near = np.all((offsets.min(axis=1) <= max_distance) & (offsets.max(axis=1) >= -max_distance), axis=1)
    corners, valid = _clip_to_heights(triangles[is_near], low, high)
    corners, valid = corners[valid.any(axis=1)] - point, valid[valid.any(axis=1)]
    if not len(corners):
        return math.inf
    return 0.0 if _contains_origin(corners, valid).any() else _distance_from_origin(corners, valid)


def _clip_to_heights(triangles: Array, low: float, high: float) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Clip triangles (m, 3, 3) to the slab between two heights.

    Returns corners (m, 9, 2), seen from above, and the mask (m, 9) of valid corners. The valid corners are the corners
    of the triangle in the slab, and the points where its edges cross the two heights. Their convex hull is the result.
    """
    z = triangles[:, :, 2]
    corners, valid = [triangles[:, :, :2]], [(z >= low) & (z <= high)]
    ends, end_z = np.roll(triangles, -1, axis=1)[:, :, :2], np.roll(z, -1, axis=1)
    for height in (low, high):
        crosses = (z > height) != (end_z > height)
        fraction = (height - z) / np.where(crosses, end_z - z, 1.0)
        corners.append(triangles[:, :, :2] + fraction[:, :, None] * (ends - triangles[:, :, :2]))
        valid.append(crosses)
    return np.concatenate(corners, axis=1), np.concatenate(valid, axis=1)


def _contains_origin(corners: Array, valid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which convex hulls of valid corners (m, 9, 2) contain the origin.

    A hull contains the origin if no angle between neighboring corners, seen from the origin, reaches 180°.
    """
    angles = np.where(valid, np.arctan2(corners[:, :, 1], corners[:, :, 0]), np.nan)
    angles = np.sort(angles, axis=1)
    last = np.nanmax(angles, axis=1) - 2 * math.pi
    gaps = np.diff(np.column_stack((last, angles)), axis=1)
    is_inside: npt.NDArray[np.bool_] = np.nanmax(gaps, axis=1) < math.pi - 1e-9
    return is_inside


def _distance_from_origin(corners: Array, valid: npt.NDArray[np.bool_]) -> float:
    """Return the distance from the origin to the nearest convex hull of valid corners (m, 9, 2).

    No hull may contain the origin.
    """
    first, second = np.triu_indices(corners.shape[1])
    both_valid = valid[:, first] & valid[:, second]
    a, b = corners[:, first][both_valid], corners[:, second][both_valid]
    edge = b - a
    squared_length = np.einsum("ij,ij->i", edge, edge)
    fraction = np.clip(-np.einsum("ij,ij->i", a, edge) / np.where(squared_length > 0, squared_length, 1.0), 0.0, 1.0)
    return float(np.sqrt(np.min(np.sum((a + fraction[:, None] * edge) ** 2, axis=1))))


def footprint_overlaps_solid(solid: Solid, corners: Polygon, z_range: tuple[float, float]) -> bool:
    """Return whether a footprint overlaps the part of a solid between two heights.

    `corners` are the corners of the footprint, in the same frame as the pose of the solid.
    """
    sections = sections_between(merge_solids([solid]), z_range)
    return any(_overlaps_outline(section.segments, corners) for section in sections)


def _overlaps_outline(segments: Array, corners: Polygon) -> bool:
    """Return whether a footprint overlaps the cross section of a solid, given by its segments (n, 2, 2)."""
    if not len(segments):
        return False
    edges = zip(corners, (*corners[1:], corners[0]), strict=True)
    return (
        winds_around(segments, corners[0])
        or any(_crosses_segment(segments, np.array(a), np.array(b)) for a, b in edges)
        or bool(points_in_polygon(corners, segments[:, 0]).any())  # the footprint may contain the entire solid
    )


def _crosses_segment(segments: Array, a: Array, b: Array) -> bool:
    """Return whether any of the segments (n, 2, 2) properly crosses the segment from a to b."""
    edge, along = b - a, segments[:, 1] - segments[:, 0]
    side = edge[0] * (segments[:, :, 1] - a[1]) - edge[1] * (segments[:, :, 0] - a[0])
    from_start, from_end = a - segments[:, 0], b - segments[:, 0]
    first = along[:, 0] * from_start[:, 1] - along[:, 1] * from_start[:, 0]
    last = along[:, 0] * from_end[:, 1] - along[:, 1] * from_end[:, 0]
    return bool(np.any((side[:, 0] * side[:, 1] < 0) & (first * last < 0)))
