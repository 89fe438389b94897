"""Upright prisms over convex bases, computed in plain Python.

Commands that must answer at once use these instead of triangle meshes, so that they need not import numpy. The bases
equal those of `triangulation.triangulate`, corner for corner.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M
from simscen.core.geometry.polygons import distance_to_segment
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Solid
from simscen.worlds.geometry.circle_facets import facet_count


class UprightPrism(NamedTuple):
    """A prism over a convex polygon, anticlockwise, from the height `bottom` to the height `top`, in meters."""

    base: Polygon
    bottom: float
    top: float

    @property
    def rectangle(self) -> tuple[float, float, float, float]:
        """What it covers at most, as (min x, min y, max x, max y)."""
        xs, ys = [x for x, _ in self.base], [y for _, y in self.base]
        return min(xs), min(ys), max(xs), max(ys)

    def distance(self, point: tuple[float, float], z_range: tuple[float, float]) -> float:
        """Horizontal distance from a point to what it has between two heights: 0 inside, inf if there is nothing."""
        low, high = z_range
        if self.bottom >= high or self.top <= low:
            return math.inf
        x, y = point
        edges = list(zip(self.base, (*self.base[1:], self.base[0]), strict=True))
        if all((bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0 for (ax, ay), (bx, by) in edges):
            return 0.0
        return min(distance_to_segment(x, y, a, b) for a, b in edges)


def upright_prism(solid: Solid, frame: Pose3 | None = None) -> UprightPrism | None:
    """The prism that a solid is; None for one that is tilted, round upwards, or has a base that is not convex.

    `frame` is where the owner of the solid stands.
    """
    poses = (solid.pose,) if frame is None else (solid.pose, frame)
    if any(pose.qx != 0 or pose.qy != 0 for pose in poses):
        return None
    match solid.shape:
        case Box((x, y, height)):
            base: Polygon = ((-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2))
            bottom, top = -height / 2, height / 2
        case Cylinder(radius, height):
            base, bottom, top = _circle(radius), -height / 2, height / 2
        case Extrusion(polygon, height):
            base, bottom, top = polygon, 0.0, height
        case _:
            return None
    for pose in poses:
        base, bottom, top = _placed(base, pose), bottom + pose.z, top + pose.z
    base = next((way for way in (base, base[::-1]) if _convex(way)), ())
    return UprightPrism(base, bottom, top) if base else None


def _circle(radius: float) -> Polygon:
    count = facet_count(radius)
    angles = [2 * math.pi * k / count for k in range(count)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def _placed(base: Polygon, pose: Pose3) -> Polygon:
    c, s = 1 - 2 * pose.qz * pose.qz, 2 * pose.qz * pose.qw
    return tuple((c * x - s * y + pose.x, s * x + c * y + pose.y) for x, y in base)


def _convex(base: Polygon) -> bool:
    """Whether every corner turns left, and all of them together turn around once: a star turns around twice."""
    ways = [(bx - ax, by - ay) for (ax, ay), (bx, by) in zip(base, (*base[1:], base[0]), strict=True)]
    turns = [
        math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        for (ax, ay), (bx, by) in zip(ways, (*ways[1:], ways[0]), strict=True)
    ]
    return all(0 < turn < math.pi for turn in turns) and sum(turns) < 3 * math.pi


def is_flat(solids: Iterable[Solid], reach: float) -> bool:
    """Whether it is plain without a look at triangles that wheels get onto no solid."""
    prisms = [upright_prism(solid) for solid in solids]
    return all(prism is not None and (prism.top > reach or prism.top <= FLOOR_HEIGHT_M) for prism in prisms)


def plan_rectangle(solid: Solid, frame: Pose3 | None = None) -> tuple[float, float, float, float]:
    """What a solid covers in plan at most, as (min x, min y, max x, max y); `frame` is where it is placed."""
    prism = upright_prism(solid, frame)
    if prism is not None:
        return prism.rectangle
    (left, low), (right, high) = plan_extents(solid, frame).tolist()
    return left, low, right, high


def plan_extents(solid: Solid, frame: Pose3 | None = None) -> Array:
    """The lower left and upper right corner (2, 2) of what any solid covers in plan; `frame` is where it is placed."""
    from simscen.worlds.geometry.triangulation import triangulate

    pose = frame.compose(solid.pose) if frame else solid.pose
    corners = pose.apply(triangulate(solid.shape).vertices)[:, :2]
    return np.stack((corners.min(axis=0), corners.max(axis=0)))
