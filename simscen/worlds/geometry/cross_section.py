"""Horizontal cross sections of triangle meshes."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh

MAX_SECTIONS = 12
"""Maximum number of cross sections between two heights. Walls and boxes need only one."""


@dataclass(frozen=True, eq=False)
class CrossSection:
    """Outlines of solids at one height, seen from above.

    segments (n, 2, 2):  start and end point of each segment in m; the inside of the solid is on its left
    owners (n,):         index of the solid that each segment belongs to
    """

    segments: Array
    owners: npt.NDArray[np.int32]


def cross_section(mesh: TriangleMesh, height: float) -> CrossSection:
    """Return the cross section of a mesh at `height` m. The segments form closed loops if the mesh is closed.

    A vertex at exactly `height` counts as above it. A box is therefore cut from its underside (excluded) to its top
    (included).
    """
    above = mesh.vertices[:, 2] >= height
    count_above = above[mesh.faces].sum(axis=1)
    is_cut = (count_above == 1) | (count_above == 2)
    # The tip of a triangle is the corner that is alone on its side of `height`.
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


def sections_between(mesh: TriangleMesh, z_range: tuple[float, float]) -> list[CrossSection]:
    """Return at most MAX_SECTIONS cross sections of a mesh between two heights.

    There is one cross section between any two neighboring heights of vertices. If these would be more than
    MAX_SECTIONS, the cross sections are evenly spaced.
    """
    low, high = z_range
    z = np.unique(np.round(mesh.vertices[:, 2], 3))
    levels = np.concatenate(([low], z[(z > low) & (z < high)], [high]))
    middles = (levels[:-1] + levels[1:]) / 2
    if len(middles) > MAX_SECTIONS:
        middles = np.linspace(low, high, MAX_SECTIONS + 2)[1:-1]
    return [cross_section(mesh, height) for height in middles.tolist()]


def winds_around(segments: Array, point: tuple[float, float]) -> bool:
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
