"""Tests whether a disc or a footprint overlaps a solid, with the name of the first solid that does.

Upright prisms are tested in plain Python, so that `validate` needs no numpy for most scenarios.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from simscen.core.environment.world_model import Polygon, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import polygon_contains, segments_cross
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere
from simscen.worlds.geometry.prisms import upright_prism

ZRange = tuple[float, float]


def blocking_solid(world: World, point: tuple[float, float], radius: float, z_range: ZRange) -> str | None:
    """The name of the first static solid that a disc at `point` would overlap, or None.

    The disc is a cylinder of `radius` meters between the heights `z_range`; touching is not overlapping. Takes a
    few milliseconds for thousands of solids, as only those whose bounding ball is near are looked at.
    """
    return first_blocking(world.solids, point, radius, z_range)


def first_blocking(solids: Iterable[Solid], point: tuple[float, float], radius: float, z_range: ZRange) -> str | None:
    """Like `blocking_solid`, among some solids."""
    for solid in solids:
        if is_near(solid, point, radius) and _distance(solid, point, z_range, radius) < radius:
            return solid.name
    return None


def _distance(solid: Solid, point: tuple[float, float], z_range: ZRange, within: float) -> float:
    """Horizontal distance in meters to what a solid has between two heights; inf if that is not `within`."""
    prism = upright_prism(solid)
    if prism is not None:
        return prism.distance(point, z_range)
    from simscen.worlds.geometry.cross_section import distance_in_plan
    from simscen.worlds.geometry.triangulation import fuse

    return distance_in_plan(fuse([solid]), point, z_range, within)


def is_near(solid: Solid, point: tuple[float, float], radius: float) -> bool:
    """Whether the ball that holds a solid comes as near as `radius` meters to a point, in plan."""
    return math.hypot(solid.pose.x - point[0], solid.pose.y - point[1]) <= radius + _reach(solid.shape)


def _reach(shape: Shape) -> float:
    """The radius of a ball about the shape's origin that holds it."""
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


TOUCHING = 1e-3
"""Share by which an outline is drawn smaller: to touch is not to overlap."""


def placed(outline: Polygon, pose: Pose2) -> Polygon:
    """An outline in its own frame, where it stands."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return tuple((pose.x + c * x - s * y, pose.y + s * x + c * y) for x, y in outline)


def first_overlapping(solids: Iterable[Solid], outline: Polygon, pose: Pose2, z_range: ZRange) -> str | None:
    """The name of the first solid that `outline`, placed at `pose`, overlaps between two heights; or None."""
    reach = max(math.hypot(x, y) for x, y in outline)
    corners = placed(tuple((x * (1 - TOUCHING), y * (1 - TOUCHING)) for x, y in outline), pose)
    for solid in solids:
        if is_near(solid, (pose.x, pose.y), reach) and _overlaps(solid, corners, z_range):
            return solid.name
    return None


def polygons_overlap(one: Sequence[tuple[float, float]], other: Sequence[tuple[float, float]]) -> bool:
    """Whether two filled polygons share inner points.

    A corner on the other's border tells nothing, as where both are the same: then their middles do.
    """
    if polygon_contains(one, other[0]) or polygon_contains(other, one[0]):
        return True
    middles = [(sum(x for x, _ in ring) / len(ring), sum(y for _, y in ring) / len(ring)) for ring in (one, other)]
    if any(polygon_contains(one, middle) and polygon_contains(other, middle) for middle in middles):
        return True
    edges = list(zip(other, (*other[1:], other[0]), strict=True))
    return any(segments_cross(a, b, c, d) for a, b in zip(one, (*one[1:], one[0]), strict=True) for c, d in edges)


def _overlaps(solid: Solid, corners: Polygon, z_range: ZRange) -> bool:
    prism = upright_prism(solid)
    if prism is not None:
        low, high = z_range
        return prism.bottom < high and prism.top > low and polygons_overlap(prism.base, corners)
    from simscen.worlds.routes.clearance import cut_overlaps

    return cut_overlaps(solid, corners, z_range)
