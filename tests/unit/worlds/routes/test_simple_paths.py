"""Tests of the fast shortest paths against the exact ones."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.polygons import polygon_contains, transform_polygon
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.geometry.mesh_overlaps import footprint_overlaps_solid
from simscen.worlds.geometry.overlaps import first_solid_in_footprint
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.routes.clearance import clearance_field, search_grid
from simscen.worlds.routes.narrow_gaps import narrowest_gap
from simscen.worlds.routes.shortest_paths import ShortestPaths
from simscen.worlds.routes.simple_paths import simple_paths_between

HEIGHT_RANGE_M = (0.03, 0.3)
BOUNDS = (0.0, 0.0, 4.0, 4.0)
START, GOAL = Pose2(0.5, 2.0), Pose2(3.5, 2.0)

sizes = st.floats(0.2, 3.0)
positions = st.floats(0.0, 4.0)
boxes = st.builds(
    lambda x, y, yaw, a, b: Solid(Box((a, b, 1.0)), Pose3.planar(Pose2(x, y, yaw), 0.5), "box"),
    st.floats(1.2, 2.8), positions, st.floats(-3.0, 3.0), st.floats(0.1, 0.6), sizes,
)  # fmt: skip


def wall(x: float, low: float, high: float, name: str) -> Solid:
    return Solid(Box((0.1, high - low, 1.0)), Pose3(x, (low + high) / 2, 0.5), name)


ROOM = [
    Solid(Box((4.1, 0.1, 1.0)), Pose3(2.0, 0.0, 0.5), "south"),
    Solid(Box((4.1, 0.1, 1.0)), Pose3(2.0, 4.0, 0.5), "north"),
    wall(0.0, 0.0, 4.0, "west"),
    wall(4.0, 0.0, 4.0, "east"),
]


@settings(max_examples=30, deadline=None)
@given(st.lists(boxes, max_size=5))
def test_simple_path_is_no_shorter_than_the_exact_shortest_path(solids: list[Solid]) -> None:
    simple = simple_paths_between([*ROOM, *solids], 0.2, HEIGHT_RANGE_M)
    assert simple is not None
    length = simple.length((0.5, 2.0), (3.5, 2.0))
    exact = ShortestPaths(merge_solids([*ROOM, *solids]), BOUNDS, 0.2, HEIGHT_RANGE_M)
    if math.isfinite(length):
        assert exact.may_reach(START, GOAL)
        assert exact.length(START, GOAL) <= 1.02 * length
    elif not exact.may_reach(START, GOAL):
        assert exact.length(START, GOAL) == math.inf


def test_sealed_room_is_unreachable_and_its_narrowest_gap_is_in_the_wall() -> None:
    solids = [*ROOM, wall(2.5, 0.0, 4.0, "partition")]
    exact = ShortestPaths(merge_solids(solids), BOUNDS, 0.2, HEIGHT_RANGE_M)
    assert not exact.may_reach(START, GOAL)
    assert not exact.may_enter([START], lambda pose: pose.distance(GOAL) - 0.5)
    gap = narrowest_gap(
        clearance_field(merge_solids(solids), search_grid(BOUNDS, 0.2), HEIGHT_RANGE_M), (START, GOAL), 0.2
    )
    assert (gap.width, round(gap.x, 1)) == (0.0, 2.5)


def test_width_of_a_gap_is_measured_between_its_walls() -> None:
    for width in (0.2, 0.31, 0.38):
        solids = [*ROOM, wall(2.0, 0.0, 3.0, "low"), wall(2.0, 3.0 + width, 4.0, "high")]
        gap = narrowest_gap(
            clearance_field(merge_solids(solids), search_grid(BOUNDS, 0.2), HEIGHT_RANGE_M), (START, GOAL), 0.2
        )
        assert abs(gap.width - width) < 0.021
        assert math.dist((gap.x, gap.y), (2.0, 3.0 + width / 2)) < 0.1
        assert not ShortestPaths(merge_solids(solids), BOUNDS, 0.25, HEIGHT_RANGE_M).may_reach(START, GOAL)


OUTLINE = ((0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2))


@settings(max_examples=60, deadline=None)
@given(boxes, st.floats(0.5, 3.5), positions, st.floats(-3.0, 3.0))
def test_footprint_overlaps_boxes_that_contain_its_points(box: Solid, x: float, y: float, yaw: float) -> None:
    pose = Pose2(x, y, yaw)
    hit = first_solid_in_footprint([box], OUTLINE, pose, HEIGHT_RANGE_M) is not None
    assert (
        footprint_overlaps_solid(
            box, transform_polygon(pose, tuple((0.999 * a, 0.999 * b) for a, b in OUTLINE)), HEIGHT_RANGE_M
        )
        == hit
    )
    size = box.shape.size  # type: ignore[union-attr]
    corners = transform_polygon(
        Pose2(box.pose.x, box.pose.y, 2 * math.atan2(box.pose.qz, box.pose.qw)),
        tuple((a * size[0] / 2, b * size[1] / 2) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))),
    )
    grid = np.stack(np.meshgrid(np.linspace(-0.39, 0.39, 40), np.linspace(-0.19, 0.19, 20)), -1).reshape(-1, 2)
    inside = any(polygon_contains(corners, (px, py)) for px, py in pose.apply(grid).tolist())
    assert hit or not inside
