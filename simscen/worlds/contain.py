"""Which solid is in the way at a place: for `goal (2.5, 1.0) is inside obstacle "wall_1"`.

Simple shapes that stand upright are looked at in plain numbers, so that `validate` of most scenarios needs no numpy.
"""

import math
from collections.abc import Iterable

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere
from simscen.worlds.upright import upright

ZRange = tuple[float, float]


def blocking_solid(world: World, point: tuple[float, float], radius: float, z_range: ZRange) -> str | None:
    """The name of the first static solid that a disc at `point` would overlap, or None.

    The disc is a cylinder of `radius` metres between the heights `z_range`; touching is not overlapping. Takes a
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
    """Horizontal distance in metres to what a solid has between two heights; inf if that is not `within`."""
    prism = upright(solid)
    if prism is not None:
        return prism.distance(point, z_range)
    from simscen.worlds.meshing import fuse
    from simscen.worlds.plan_distance import distance_in_plan

    return distance_in_plan(fuse([solid]), point, z_range, within)


def is_near(solid: Solid, point: tuple[float, float], radius: float) -> bool:
    """Whether the ball that holds a solid comes as near as `radius` metres to a point, in plan."""
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
