"""Find the first solid that a disc or a footprint overlaps, and test whether two polygons overlap.

Upright prisms are tested in plain Python, without triangles and SciPy.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.polygons import polygon_contains, segments_cross, transform_polygon
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere
from simscen.worlds.geometry.prisms import upright_prism

ZRange = tuple[float, float]
"""Lower and upper height in m."""
SHRINK_FRACTION = 1e-3
"""Fraction by which an outline is shrunk before the test, because touching is not overlapping."""


def first_solid_in_disc(
    solids: Iterable[Solid], point: tuple[float, float], radius: float, z_range: ZRange
) -> str | None:
    """Return the name of the first solid that a disc at `point` overlaps, or None.

    The disc is a cylinder of `radius` m between the heights `z_range`. Touching is not overlapping.
    """
    for solid in solids:
        if is_near(solid, point, radius) and _horizontal_distance(solid, point, z_range, radius) < radius:
            return solid.name
    return None


def _horizontal_distance(solid: Solid, point: tuple[float, float], z_range: ZRange, max_distance: float) -> float:
    """Return the horizontal distance in m from a point to the part of a solid between two heights; 0 inside.

    Returns inf if the solid has no such part. Distances above `max_distance` m may be inf, too.
    """
    prism = upright_prism(solid)
    if prism is not None:
        return prism.distance(point, z_range)
    from simscen.worlds.geometry.mesh_overlaps import horizontal_distance
    from simscen.worlds.geometry.triangulation import merge_solids

    return horizontal_distance(merge_solids([solid]), point, z_range, max_distance)


def is_near(solid: Solid, point: tuple[float, float], radius: float) -> bool:
    """Return whether a solid can be at most `radius` m away from a point, judged by the solid's bounding sphere."""
    return math.hypot(solid.pose.x - point[0], solid.pose.y - point[1]) <= radius + _bounding_radius(solid.shape)


def bounding_radius(solids: Iterable[Solid]) -> float:
    """Return an upper bound in m on the horizontal distance of the points of solids from the origin; 0 for none."""
    return max((math.hypot(each.pose.x, each.pose.y) + _bounding_radius(each.shape) for each in solids), default=0.0)


def _bounding_radius(shape: Shape) -> float:
    """Return the radius in m of a sphere around the shape's origin that contains the shape."""
    match shape:
        case Box(size):
            return math.hypot(*size) / 2
        case Cylinder(radius, length) | Cone(radius, length):
            return math.hypot(radius, length / 2)
        case Sphere(radius):
            return radius
        case Capsule(radius, length):
            return radius + length / 2
        case Ellipsoid(radii):
            return max(radii)
        case Extrusion(polygon, height):
            return max(math.hypot(x, y, height) for x, y in polygon)
        case Mesh(vertices):
            return float(np.linalg.norm(vertices, axis=1).max(initial=0.0))


def first_solid_in_footprint(solids: Iterable[Solid], outline: Polygon, pose: Pose2, z_range: ZRange) -> str | None:
    """Return the name of the first solid that a footprint at `pose` overlaps between two heights, or None.

    `outline` are the corners of the footprint, in the frame at `pose`.
    """
    radius = max(math.hypot(x, y) for x, y in outline)
    corners = transform_polygon(pose, tuple((x * (1 - SHRINK_FRACTION), y * (1 - SHRINK_FRACTION)) for x, y in outline))
    for solid in solids:
        if is_near(solid, (pose.x, pose.y), radius) and _overlaps(solid, corners, z_range):
            return solid.name
    return None


def polygons_overlap(first: Sequence[tuple[float, float]], second: Sequence[tuple[float, float]]) -> bool:
    """Return whether the interiors of two polygons have a point in common.

    Tests all pairs of edges, one corner of each polygon, and both centers.
    """
    # The centers are needed for equal polygons, whose corners are not inside each other.
    if polygon_contains(first, second[0]) or polygon_contains(second, first[0]):
        return True
    centers = [(sum(x for x, _ in ring) / len(ring), sum(y for _, y in ring) / len(ring)) for ring in (first, second)]
    if any(polygon_contains(first, center) and polygon_contains(second, center) for center in centers):
        return True
    edges = list(zip(second, (*second[1:], second[0]), strict=True))
    return any(segments_cross(a, b, c, d) for a, b in zip(first, (*first[1:], first[0]), strict=True) for c, d in edges)


def _overlaps(solid: Solid, corners: Polygon, z_range: ZRange) -> bool:
    """Return whether a solid overlaps a polygon in the same frame between two heights."""
    prism = upright_prism(solid)
    if prism is not None:
        low, high = z_range
        return prism.bottom < high and prism.top > low and polygons_overlap(prism.base, corners)
    from simscen.worlds.geometry.mesh_overlaps import footprint_overlaps_solid

    return footprint_overlaps_solid(solid, corners, z_range)
