"""Whether an outline overlaps what any solid has at the height of a robot; this one needs numpy."""

import numpy as np

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import Solid
from simscen.worlds.clearance import standing_outlines
from simscen.worlds.meshing import fuse
from simscen.worlds.plan_distance import winds_about


def cut_overlaps(solid: Solid, corners: Polygon, z_range: tuple[float, float]) -> bool:
    """Whether an outline shares inner points with the cuts of a solid between two heights."""
    return any(_shares(cut.segments, corners) for cut in standing_outlines(fuse([solid]), z_range))


def _shares(segments: Array, corners: Polygon) -> bool:
    if not len(segments):
        return False
    if winds_about(segments, corners[0]):
        return True
    ends = (*corners[1:], corners[0])
    if any(_cross(segments, np.array(a), np.array(b)) for a, b in zip(corners, ends, strict=True)):
        return True
    return _some_inside(segments, corners)


def _some_inside(segments: Array, corners: Polygon) -> bool:
    """Whether a segment begins inside; the outline of a small thing may lie within the footprint as a whole."""
    (left, low), (right, high) = np.min(corners, axis=0), np.max(corners, axis=0)
    x, y = segments[:, 0].T
    near = segments[(x >= left) & (x <= right) & (y >= low) & (y <= high), 0]
    return any(polygon_contains(corners, (px, py)) for px, py in near.tolist())


def _cross(segments: Array, a: Array, b: Array) -> bool:
    """Whether any of the segments (n, 2, 2) properly crosses the one from a to b."""
    way, along = b - a, segments[:, 1] - segments[:, 0]
    side = way[0] * (segments[:, :, 1] - a[1]) - way[1] * (segments[:, :, 0] - a[0])
    from_start, from_end = a - segments[:, 0], b - segments[:, 0]
    first = along[:, 0] * from_start[:, 1] - along[:, 1] * from_start[:, 0]
    last = along[:, 0] * from_end[:, 1] - along[:, 1] * from_end[:, 0]
    return bool(np.any((side[:, 0] * side[:, 1] < 0) & (first * last < 0)))
