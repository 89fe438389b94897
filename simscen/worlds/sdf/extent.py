"""How far solids reach: exact axis-parallel boxes of turned shapes."""

from collections.abc import Iterable

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere


def reach(shape: Shape, pose: Pose3) -> tuple[Array, Array]:
    """The lowest and the highest corner (3,) of the axis-parallel box around a shape at `pose`."""
    turn, centre = pose.rotation(), np.array(pose.position)
    axis = turn[:, 2]
    match shape:
        case Box(size):
            half = np.abs(turn) @ np.array(size) / 2
        case Sphere(radius):
            half = np.full(3, radius)
        case Ellipsoid(radii):
            half = np.linalg.norm(turn * np.array(radii), axis=1)
        case Cylinder(radius, length):
            half = length / 2 * np.abs(axis) + radius * _across(axis)
        case Capsule(radius, length):
            half = length / 2 * np.abs(axis) + radius
        case Cone(radius, length):
            tip, base = axis * length / 2, radius * _across(axis)
            return centre + np.minimum(tip, -tip - base), centre + np.maximum(tip, -tip + base)
        case Extrusion(polygon, height):
            outline = np.array(polygon)
            return _around(np.vstack([np.column_stack([outline, np.full(len(outline), z)]) for z in (0, height)]), pose)
        case Mesh():
            return _around(shape.vertices, pose)
    return centre - half, centre + half


def _across(axis: Array) -> Array:
    """How far a unit disc with this axis reaches along x, y, z."""
    result: Array = np.sqrt(np.maximum(0.0, 1 - axis**2))
    return result


def _around(points: Array, pose: Pose3) -> tuple[Array, Array]:
    placed = pose.apply(points)
    return placed.min(axis=0), placed.max(axis=0)


def bounds(solids: Iterable[Solid]) -> tuple[float, float, float, float]:
    """(min x, min y, max x, max y) around all of them, in their owner's frame; zeros when there is none."""
    boxes = [reach(solid.shape, solid.pose) for solid in solids]
    if not boxes:
        return 0.0, 0.0, 0.0, 0.0
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
