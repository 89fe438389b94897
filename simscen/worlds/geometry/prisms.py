"""Upright prisms over convex bases, computed in plain Python without triangulation, and bounding rectangles of solids.

The bases of prisms have the same corners as the meshes of `triangulation.triangulate`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from simscen.core.geometry import Polygon, Pose3
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M
from simscen.core.geometry.polygons import distance_to_segment
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Solid, facet_count


class UprightPrism(NamedTuple):
    """A prism over a convex counterclockwise polygon (m), from the height `bottom` to the height `top` in m."""

    base: Polygon
    bottom: float
    top: float

    @property
    def rectangle(self) -> tuple[float, float, float, float]:
        """Bounding rectangle of the base as (min x, min y, max x, max y) in m."""
        xs, ys = [x for x, _ in self.base], [y for _, y in self.base]
        return min(xs), min(ys), max(xs), max(ys)

    def distance(self, point: tuple[float, float], z_range: tuple[float, float]) -> float:
        """Return the horizontal distance in m from a point to the part of the prism between two heights.

        Returns 0 inside the prism, and inf if it has no part between the heights `z_range`.
        """
        low, high = z_range
        if self.bottom >= high or self.top <= low:
            return math.inf
        x, y = point
        edges = list(zip(self.base, (*self.base[1:], self.base[0]), strict=True))
        if all((bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0 for (ax, ay), (bx, by) in edges):
            return 0.0
        return min(distance_to_segment(x, y, a, b) for a, b in edges)


def upright_prism(solid: Solid, frame: Pose3 | None = None) -> UprightPrism | None:
    """Return a solid as a prism; None if the solid is tilted, not a prism, or has a base that is not convex.

    `frame` is the pose of the frame that the solid's pose refers to, for example of a body; default: the world.
    """
    poses = (solid.pose,) if frame is None else (solid.pose, frame)
    if any(pose.qx != 0 or pose.qy != 0 for pose in poses):
        return None
    match solid.shape:
        case Box((x, y, height)):
            base: Polygon = ((-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2))
            bottom, top = -height / 2, height / 2
        case Cylinder(radius, height):
            count = facet_count(radius)
            angles = [2 * math.pi * k / count for k in range(count)]
            base = tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)
            bottom, top = -height / 2, height / 2
        case Extrusion(polygon, height):
            base, bottom, top = polygon, 0.0, height
        case _:
            return None
    for pose in poses:
        c, s = 1 - 2 * pose.qz * pose.qz, 2 * pose.qz * pose.qw  # cosine and sine of the yaw
        base = tuple((c * x - s * y + pose.x, s * x + c * y + pose.y) for x, y in base)
        bottom, top = bottom + pose.z, top + pose.z
    base = next((ring for ring in (base, base[::-1]) if _is_convex_and_counterclockwise(ring)), ())
    return UprightPrism(base, bottom, top) if base else None


def _is_convex_and_counterclockwise(base: Polygon) -> bool:
    """Return whether every corner turns left, and the sum of the turns is 360°."""
    edges = [(bx - ax, by - ay) for (ax, ay), (bx, by) in zip(base, (*base[1:], base[0]), strict=True)]
    turns = [
        math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        for (ax, ay), (bx, by) in zip(edges, (*edges[1:], edges[0]), strict=True)
    ]
    return all(0 < turn < math.pi for turn in turns) and sum(turns) < 3 * math.pi


def has_no_drivable_solids(solids: Iterable[Solid], max_height: float) -> bool:
    """Return whether all solids are upright prisms that end above `max_height` m, so that wheels cannot drive on them.

    Prisms that end at the floor are ignored. False means that the triangles of the solids must be examined.
    """
    prisms = [upright_prism(solid) for solid in solids]
    return all(prism is not None and (prism.top > max_height or prism.top <= FLOOR_HEIGHT_M) for prism in prisms)


def bounding_rectangle(solid: Solid, frame: Pose3 | None = None) -> tuple[float, float, float, float]:
    """Return the bounding rectangle of a solid, seen from above, as (min x, min y, max x, max y) in m.

    `frame` is the pose of the frame that the solid's pose refers to; default: the world.
    """
    prism = upright_prism(solid, frame)
    if prism is not None:
        return prism.rectangle
    from simscen.worlds.geometry.triangulation import triangulate

    pose = frame.compose(solid.pose) if frame else solid.pose
    vertices = pose.apply(triangulate(solid.shape).vertices)
    (left, bottom, _), (right, top, _) = vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()
    return left, bottom, right, top
