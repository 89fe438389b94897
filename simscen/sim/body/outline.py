"""Convex hulls of shapes, and outlines of solids seen from above, such as footprints."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Polygon, Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere

MIN_POINTS_TO_FILTER = 200
"""Smallest number of points for which `convex_hull` first discards points that cannot be corners."""
_HULL_CIRCLE_POINTS = 64
"""Number of points that `hull_points` places on a circle."""


def circle(radius: float, corners: int = 32) -> Polygon:
    """Return a regular polygon whose corners are on a circle around the origin, counterclockwise from the x axis."""
    angles = [2 * math.pi * k / corners for k in range(corners)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def footprint(solids: Iterable[Solid]) -> Polygon:
    """Return the convex outline of solids seen from above, counterclockwise."""
    return convex_hull(np.concatenate([solid.pose.apply(hull_points(solid.shape))[:, :2] for solid in solids]))


def outlines_in_z_range(solids: Iterable[Solid], z_range: tuple[float, float]) -> list[Polygon]:
    """Return the outlines, seen from above, of the solids that extend into `z_range` (lowest, highest) in m.

    The outline of an upright extrusion can be concave; all other outlines are convex hulls.
    """
    return [outline for solid in solids if (outline := _outline(solid.shape, solid.pose, z_range))]


@cached_on_instance
def _outline(shape: Shape, pose: Pose3, z_range: tuple[float, float]) -> Polygon:
    """Return the outline of a shape at `pose`, or () if the shape is not in `z_range`. The result is cached."""
    corners = pose.apply(hull_points(shape))
    if corners[:, 2].min() >= z_range[1] or corners[:, 2].max() <= z_range[0]:
        return ()
    upright = isinstance(shape, Extrusion) and pose.qx == pose.qy == 0
    bottom = corners[: len(corners) // 2, :2]
    outline = tuple((x, y) for x, y in bottom.tolist()) if upright else convex_hull(corners[:, :2])
    return outline if len(outline) > 2 else ()


def hull_points(shape: Shape) -> Array:
    """Return points (n, 3) that span the convex hull of a shape; circles are approximated by 64 points."""
    match shape:
        case Box(size):
            return np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]) * size
        case Cylinder(radius, length):
            return _circle_points(np.array([radius, radius]), np.array([-length / 2, length / 2]))
        case Cone(radius, length):
            return np.concatenate(
                (_circle_points(np.array([radius]), np.array([-length / 2])), [[0.0, 0.0, length / 2]])
            )
        case Sphere(radius):
            return _ellipsoid_points((radius, radius, radius))
        case Ellipsoid(radii):
            return _ellipsoid_points(radii)
        case Capsule(radius, length):
            ball, up = _ellipsoid_points((radius, radius, radius)), np.array([0.0, 0.0, length / 2])
            return np.concatenate((ball - up, ball + up))
        case Extrusion(polygon, height):
            return np.array([(x, y, z) for z in (0.0, height) for x, y in polygon])
        case Mesh(vertices):
            return vertices


def radius_and_height(solids: Iterable[Solid]) -> tuple[float, float]:
    """Return the largest distance from the z axis in m, and the largest absolute z in m."""
    points = np.concatenate([solid.pose.apply(hull_points(solid.shape)) for solid in solids])
    return float(np.hypot(points[:, 0], points[:, 1]).max()), float(np.abs(points[:, 2]).max())


def convex_hull(points: Array) -> Polygon:
    """Return the convex hull of points (n, 2), counterclockwise (Andrew's monotone chain, 1979)."""
    ordered = sorted({(round(x, 9), round(y, 9)) for x, y in _without_inner_points(points).tolist()})
    if len(ordered) < 3:
        return tuple(ordered)
    return (*_chain(ordered)[:-1], *_chain(ordered[::-1])[:-1])


def _without_inner_points(points: Array) -> Array:
    """Discard most points that are not corners of the convex hull (Akl and Toussaint 1978)."""
    if len(points) < MIN_POINTS_TO_FILTER:
        return points
    angles = np.arange(32) * (math.pi / 16)
    extremes = (points @ np.array([np.cos(angles), np.sin(angles)])).argmax(axis=0)
    ring = points[extremes]
    sides = np.roll(ring, -1, axis=0) - ring
    across = (points @ np.array([-sides[:, 1], sides[:, 0]])) - (ring[:, 1] * sides[:, 0] - ring[:, 0] * sides[:, 1])
    inside = ((across > 1e-6) | (np.abs(sides).sum(axis=1) == 0.0)).all(axis=1)
    inside[extremes] = False
    outer: Array = points[~inside]
    return outer


def _chain(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return one half of the convex hull of sorted points, from the first point to the last."""
    chain: list[tuple[float, float]] = []
    for x, y in points:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2:]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            chain.pop()
        chain.append((x, y))
    return chain


def _circle_points(radii: Array, heights: Array) -> Array:
    """Return the points (n, 3) of horizontal circles around the z axis, given their radii and heights in m."""
    angles = np.arange(_HULL_CIRCLE_POINTS) * (2 * math.pi / _HULL_CIRCLE_POINTS)
    points = np.empty((len(radii), _HULL_CIRCLE_POINTS, 3))
    points[:, :, 0], points[:, :, 1] = np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))
    points[:, :, 2] = heights[:, None]
    return points.reshape(-1, 3)


def _ellipsoid_points(radii: tuple[float, float, float]) -> Array:
    """Return points (n, 3) on an ellipsoid at the origin."""
    latitudes = np.linspace(-math.pi / 2, math.pi / 2, _HULL_CIRCLE_POINTS // 2 + 1).tolist()
    rings = [(max(0.0, math.cos(latitude)), math.sin(latitude)) for latitude in latitudes]
    result: Array = _circle_points(*np.array(rings).T) * radii
    return result


MAX_UNREDUCED_VERTICES = 256
"""Number of vertices up to which `reduce_hull_vertices` keeps all of them."""
HULL_TOLERANCE_M = 0.001
"""Largest distance in m of an omitted vertex from the reduced hull."""


@cached_on_instance
def reduce_hull_vertices(mesh: Mesh) -> Array:
    """Return vertices (n, 3) of a mesh that span its convex hull within HULL_TOLERANCE_M. The result is cached.

    Returns all vertices if they are few or lie in a plane.
    """
    if len(mesh.vertices) <= MAX_UNREDUCED_VERTICES:
        return mesh.vertices
    from scipy.spatial import ConvexHull, QhullError

    try:
        # Qhull's option W: a point that is outside of a facet by less counts as inside.
        hull = ConvexHull(mesh.vertices, qhull_options=f"Qt W{HULL_TOLERANCE_M}")
    except QhullError:
        return mesh.vertices
    corners: Array = mesh.vertices[np.sort(hull.vertices)]
    return corners
