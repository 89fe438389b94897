"""Horizontal cross sections of meshes, their conversion to polygons, and the horizontal distance to a mesh."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import TriangleMesh

Point = tuple[float, float]
"""(x, y) in m."""
Ring = list[Point]
"""Corners of a closed polygon; the first corner is not repeated at the end."""

STRAIGHTNESS_TOLERANCE_M = 1e-6
"""A corner is removed from a ring if it is at most this far from the line between its neighbors."""
MAX_CORNERS = 200
"""Maximum number of corners of a polygon in a world file."""


class OpenCrossSection(ValueError):
    """The cross section of a mesh is not closed, because the mesh has holes."""


@dataclass(frozen=True, eq=False)
class CrossSection:
    """Outlines of solids at one height, seen from above.

    segments (n, 2, 2):  start and end point of each segment in m; the inside of the solid is on its left
    owners (n,):         index of the solid that each segment belongs to
    """

    segments: Array
    owners: npt.NDArray[np.int32]


def section_segments(mesh: TriangleMesh, height: float) -> Array:
    """Return only the segments (n, 2, 2) of the cross section at `height` m; see `CrossSection`."""
    return cross_section(mesh, height).segments


def cross_section(mesh: TriangleMesh, height: float) -> CrossSection:
    """Return the cross section of a mesh at `height` m. The segments form closed loops if the mesh is closed.

    A vertex at exactly `height` counts as above it. A box is therefore cut from its underside (excluded) to its top
    (included).
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
    """Return the points (n, 2) where the edges between `tip` (n, 3) and `base` (n, 3) cross `height`.

    The computation always follows the edge upwards, so that both triangles of an edge get exactly the same point.
    """
    low, high = np.where(is_tip_above[:, None], base, tip), np.where(is_tip_above[:, None], tip, base)
    fraction = (height - low[:, 2]) / (high[:, 2] - low[:, 2])
    point: Array = low[:, :2] + fraction[:, None] * (high - low)[:, :2]
    return point


def horizontal_distance(
    mesh: TriangleMesh, point: Point, z_range: tuple[float, float], within: float = math.inf
) -> float:
    """Return the horizontal distance in m from a point to the part of the mesh between two heights; 0 inside.

    Returns inf if the mesh has no part between the heights `z_range`. Distances above `within` m may be inf as well.
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


def _triangles_near(mesh: TriangleMesh, point: Point, distance: float) -> Array:
    """Return the triangles (m, 3, 3) whose bounding rectangle is at most `distance` m away from the point."""
    triangles = mesh.vertices[mesh.faces]
    corners = triangles[:, :, :2] - point
    is_near = np.all((corners.min(axis=1) <= distance) & (corners.max(axis=1) >= -distance), axis=1)
    near: Array = triangles[is_near]
    return near


def winds_around(segments: Array, point: Point) -> bool:
    """Return whether segments (n, 2, 2) wind counterclockwise around a point, so that the point is inside a solid.

    The crossings of two rays from the point, towards +x and -x, are counted. For meshes with holes, a single ray could
    report points outside as inside.
    """
    (x0, y0), (x1, y1) = segments[:, 0].T - np.array(point)[:, None], segments[:, 1].T - np.array(point)[:, None]
    crosses = (y0 > 0) != (y1 > 0)
    x0, y0, x1, y1 = x0[crosses], y0[crosses], x1[crosses], y1[crosses]
    is_towards_positive_x = x0 - y0 * (x1 - x0) / (y1 - y0) > 0
    direction = np.where(y1 > y0, 1, -1)
    return bool(direction[is_towards_positive_x].sum() > 0 and -direction[~is_towards_positive_x].sum() > 0)


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


def rings_from_segments(segments: Array) -> list[Ring]:
    """Join directed segments (n, 2, 2) to closed rings: counterclockwise outlines of solids, and clockwise holes.

    Rings that touch at a corner are separated, so that no ring visits a point twice. Raises OpenCrossSection if a ring
    is not closed.
    """
    next_points: dict[Point, list[Point]] = {}
    for (ax, ay), (bx, by) in segments.tolist():
        next_points.setdefault((ax, ay), []).append((bx, by))
    rings = []
    for start in list(next_points):
        while next_points[start]:
            path: dict[Point, None] = {start: None}  # a dict as an ordered set
            while path:
                last = next(reversed(path))
                if not next_points.get(last):
                    raise OpenCrossSection
                point = next_points[last].pop()
                if point in path:
                    points = list(path)
                    first = points.index(point)
                    rings.append(_without_straight_corners(points[first:]))
                    path = dict.fromkeys(points[: first + 1]) if first else {}
                else:
                    path[point] = None
    return [ring for ring in rings if len(ring) >= 3]


def simple_polygons(rings: list[Ring]) -> list[Ring]:
    """Return polygons without holes that cover the area that the rings enclose.

    A ring with holes, or with more than MAX_CORNERS corners, is divided into triangles.
    """
    outer_rings = [ring for ring in rings if signed_area(ring) > 0]
    holes: dict[int, list[Ring]] = {number: [] for number in range(len(outer_rings))}
    for ring in rings:
        # The middle of an edge is tested, because a corner of a hole may touch the ring around it.
        middle = ((ring[0][0] + ring[1][0]) / 2, (ring[0][1] + ring[1][1]) / 2)
        around = [n for n, other in enumerate(outer_rings) if signed_area(ring) < 0 and polygon_contains(other, middle)]
        if around:
            holes[min(around, key=lambda n: signed_area(outer_rings[n]))].append(ring)
    polygons: list[Ring] = []
    for number, ring in enumerate(outer_rings):
        is_simple = not holes[number] and len(ring) <= MAX_CORNERS
        polygons += [ring] if is_simple else _triangles([ring, *holes[number]])
    return polygons


def signed_area(ring: Ring) -> float:
    """Return the area in m², positive for a counterclockwise ring."""
    x, y = np.array(ring).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _triangles(rings: list[Ring]) -> list[Ring]:
    """Return counterclockwise triangles that cover the outer ring `rings[0]` except its holes `rings[1:]`."""
    import mapbox_earcut

    points = np.array([point for ring in rings for point in ring])
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3)
    triangles = [[(float(x), float(y)) for x, y in points[face]] for face in faces]
    counterclockwise = [ring if signed_area(ring) > 0 else ring[::-1] for ring in triangles]
    return [ring for ring in counterclockwise if signed_area(ring) > STRAIGHTNESS_TOLERANCE_M**2]


def _without_straight_corners(ring: Ring) -> Ring:
    """Return the ring without the corners on straight edges, where two triangles of the mesh meet."""
    # Each corner is compared with the last kept one, so that a round ring of short chords keeps its shape.
    kept: Ring = [ring[0]]
    for point, following in zip(ring[1:], [*ring[2:], ring[0]], strict=True):
        if _is_corner(kept[-1], point, following):
            kept.append(point)
    return kept if len(kept) < 3 or _is_corner(kept[-1], kept[0], kept[1]) else kept[1:]


def _is_corner(before: Point, point: Point, after: Point) -> bool:
    """Return whether removing the point would move the ring by more than STRAIGHTNESS_TOLERANCE_M."""
    (ax, ay), (px, py), (bx, by) = before, point, after
    length = math.hypot(bx - ax, by - ay)
    if length < STRAIGHTNESS_TOLERANCE_M:
        return True
    return abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length > STRAIGHTNESS_TOLERANCE_M
