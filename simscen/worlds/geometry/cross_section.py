"""Horizontal cross sections of meshes, and the distance from a point to a mesh in plan.

A cross section holds what a level lidar at that height can see.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh


@dataclass(frozen=True, eq=False)
class Section:
    """Directed segments (n, 2, 2) in meters with the solid on their left, and the owner (n,) of each."""

    segments: Array
    owners: npt.NDArray[np.int32]


def outlines(mesh: TriangleMesh, height: float) -> Array:
    """The cut of the mesh at `height` as segments (n, 2, 2): [k, 0] is where segment k begins, [k, 1] its end."""
    return section(mesh, height).segments


def section(mesh: TriangleMesh, height: float) -> Section:
    """The cut of the mesh at `height`; closed loops wherever the mesh is closed.

    A vertex at exactly `height` counts as above it, so a box is cut from its underside (not included) to its top
    (included) and no cut is ever a point or a whole face. Both triangles at an edge compute the same point, bit
    for bit, as both walk the edge upwards.
    """
    above = mesh.vertices[:, 2] >= height
    count = above[mesh.faces].sum(axis=1)
    cut = (count == 1) | (count == 2)
    faces, lone_above = mesh.faces[cut], count[cut] == 1
    lone = np.argmax(above[faces] == lone_above[:, None], axis=1)
    turned = faces[np.arange(len(faces))[:, None], (lone[:, None] + np.arange(3)) % 3]
    tip, left, right = mesh.vertices[turned].swapaxes(0, 1)
    first, second = _crossing(tip, left, height, lone_above), _crossing(tip, right, height, lone_above)
    segments = np.where(lone_above[:, None, None], np.stack((first, second), 1), np.stack((second, first), 1))
    long = np.any(segments[:, 0] != segments[:, 1], axis=1)
    return Section(segments[long], mesh.owners[cut][long])


def _crossing(tip: Array, base: Array, height: float, tip_above: npt.NDArray[np.bool_]) -> Array:
    """Where the edges between `tip` (n, 3) and `base` (n, 3) pass the height, as (n, 2)."""
    low, high = np.where(tip_above[:, None], base, tip), np.where(tip_above[:, None], tip, base)
    along = (height - low[:, 2]) / (high[:, 2] - low[:, 2])
    point: Array = low[:, :2] + along[:, None] * (high - low)[:, :2]
    return point


def distance_in_plan(
    mesh: TriangleMesh, point: tuple[float, float], z_range: tuple[float, float], within: float = math.inf
) -> float:
    """Horizontal distance in meters from a point to what a mesh has between two heights; 0 inside of it.

    inf if there is nothing at those heights, or nothing nearer than `within`.
    """
    low, high = z_range
    bottom, top = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    if bottom >= high or top <= low:
        return math.inf
    middle = (max(bottom, low) + min(top, high)) / 2
    if winds_about(outlines(mesh, middle), point):
        return 0.0
    corners, valid = _clipped(_close(mesh, point, within), low, high)
    corners, valid = corners[valid.any(axis=1)] - point, valid[valid.any(axis=1)]
    if not len(corners):
        return math.inf
    return 0.0 if _around_origin(corners, valid).any() else _nearest(corners, valid)


def _close(mesh: TriangleMesh, point: tuple[float, float], within: float) -> Array:
    """The triangles (m, 3, 3) whose bounding rectangle is not further from the point than `within`."""
    triangles = mesh.vertices[mesh.faces]
    plan = triangles[:, :, :2] - point
    close = np.all((plan.min(axis=1) <= within) & (plan.max(axis=1) >= -within), axis=1)
    near: Array = triangles[close]
    return near


def winds_about(segments: Array, point: tuple[float, float]) -> bool:
    """Whether outlines wind anticlockwise about a point, as seen both towards +x and towards -x.

    For closed outlines both counts are the same; where a mesh has holes, one alone would find insides that leak.
    """
    (x0, y0), (x1, y1) = segments[:, 0].T - np.array(point)[:, None], segments[:, 1].T - np.array(point)[:, None]
    crosses = (y0 > 0) != (y1 > 0)
    x0, y0, x1, y1 = x0[crosses], y0[crosses], x1[crosses], y1[crosses]
    ahead = x0 - y0 * (x1 - x0) / (y1 - y0) > 0
    upwards = np.where(y1 > y0, 1, -1)
    return bool(upwards[ahead].sum() > 0 and -upwards[~ahead].sum() > 0)


def _clipped(triangles: Array, low: float, high: float) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The part of triangles (m, 3, 3) between two heights, in plan: up to 9 corners (m, 9, 2) and which of them count.

    A clipped triangle is convex, so its own corners inside the slab and the points where its edges pass the slab's
    faces are all there is to know.
    """
    z = triangles[:, :, 2]
    corners, valid = [triangles[:, :, :2]], [(z >= low) & (z <= high)]
    ends, end_z = np.roll(triangles, -1, axis=1)[:, :, :2], np.roll(z, -1, axis=1)
    for height in (low, high):
        crosses = (z > height) != (end_z > height)
        along = (height - z) / np.where(crosses, end_z - z, 1.0)
        corners.append(triangles[:, :, :2] + along[:, :, None] * (ends - triangles[:, :, :2]))
        valid.append(crosses)
    return np.concatenate(corners, axis=1), np.concatenate(valid, axis=1)


def _around_origin(corners: Array, valid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which convex sets have the origin inside: seen from it, no gap between their corners is 180° or more."""
    angles = np.where(valid, np.arctan2(corners[:, :, 1], corners[:, :, 0]), np.nan)
    angles = np.sort(angles, axis=1)
    last = np.nanmax(angles, axis=1) - 2 * math.pi
    gaps = np.diff(np.column_stack((last, angles)), axis=1)
    inside: npt.NDArray[np.bool_] = np.nanmax(gaps, axis=1) < math.pi - 1e-9
    return inside


def _nearest(corners: Array, valid: npt.NDArray[np.bool_]) -> float:
    """Distance from the origin to the nearest of convex sets that do not hold it: their edges are among all pairs."""
    first, second = np.triu_indices(corners.shape[1])
    both = valid[:, first] & valid[:, second]
    a, b = corners[:, first][both], corners[:, second][both]
    step = b - a
    squared = np.einsum("ij,ij->i", step, step)
    along = np.clip(-np.einsum("ij,ij->i", a, step) / np.where(squared > 0, squared, 1.0), 0.0, 1.0)
    return float(np.sqrt(np.min(np.sum((a + along[:, None] * step) ** 2, axis=1))))
