"""Which solid a robot's footprint would overlap: its true outline where it stands and as it is turned.

Solids that stand upright are looked at in plain numbers, like in `contain`.
"""

import math
from collections.abc import Iterable, Sequence

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import polygon_contains, segments_cross
from simscen.core.geometry.shapes import Solid
from simscen.worlds.contain import ZRange, is_near
from simscen.worlds.upright import upright

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
    prism = upright(solid)
    if prism is not None:
        low, high = z_range
        return prism.bottom < high and prism.top > low and polygons_overlap(prism.base, corners)
    from simscen.worlds.cuts import cut_overlaps

    return cut_overlaps(solid, corners, z_range)
