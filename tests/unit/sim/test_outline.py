"""Tests of convex hulls, footprints, and outlines of shapes."""

import math

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Polygon

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Solid, Sphere
from simscen.sim.body.outline import circle, convex_hull, footprint, hull_points, outlines_in_z_range


def test_convex_hull_equals_that_of_shapely():
    points = np.random.default_rng(1).normal(size=(500, 2))
    hull = Polygon(convex_hull(points))
    expected = MultiPoint(points).convex_hull
    assert hull.exterior.is_ccw
    assert hull.symmetric_difference(expected).area < 1e-6


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        (Box((0.4, 0.3, 0.2)), 0.12),
        (Cylinder(0.2, 0.5), math.pi * 0.04),
        (Sphere(0.2), math.pi * 0.04),
        (Capsule(0.2, 0.5), math.pi * 0.04),
        (Ellipsoid((0.1, 0.3, 0.2)), math.pi * 0.03),
        (Cone(0.2, 0.6), math.pi * 0.04),
        (Extrusion(((0, 0), (2, 0), (0, 2)), 0.5), 2.0),
    ],
    ids=lambda value: type(value).__name__,
)
def test_footprint_has_the_area_of_the_shape_seen_from_above(shape, area):
    placed = Solid(shape, Pose3.planar(Pose2(1.0, 2.0, 0.3), 0.5))
    assert Polygon(footprint([placed])).area == pytest.approx(area, rel=0.01)


def test_footprint_of_a_lying_cylinder_is_a_rectangle():
    lying = Solid(Cylinder(0.1, 0.6), Pose3.from_rpy(0, 0, 0.1, math.pi / 2, 0, 0))
    assert Polygon(footprint([lying])).bounds == pytest.approx((-0.1, -0.3, 0.1, 0.3), abs=1e-3)


def test_hull_points_of_a_box_include_its_corners():
    assert hull_points(Box((2.0, 4.0, 6.0))).max(axis=0).tolist() == [1.0, 2.0, 3.0]


def test_a_circle_has_its_corners_on_the_circle_counterclockwise():
    corners = circle(0.22)
    assert [math.hypot(x, y) for x, y in corners] == pytest.approx([0.22] * len(corners))
    assert Polygon(corners).exterior.is_ccw


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("shape", ["cloud", "disc", "square", "line", "far", "same"])
def test_convex_hull_of_many_points_equals_that_of_shapely(shape, seed):
    """Most points are discarded beforehand, but none of the corners."""
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(3000, 2))
    points = {
        "cloud": cloud,
        "disc": cloud / np.linalg.norm(cloud, axis=1, keepdims=True),
        "square": rng.integers(0, 30, (3000, 2)) * 0.1,
        "line": np.column_stack((cloud[:, 0], 2 * cloud[:, 0])),
        "far": cloud * 0.01 + 1e4,
        "same": np.ones((3000, 2)),
    }[shape]
    ours = MultiPoint(convex_hull(points)).convex_hull
    assert ours.hausdorff_distance(MultiPoint(points).convex_hull) <= 2e-9


def test_outlines_are_those_of_the_solids_in_the_z_range():
    box = Box((0.4, 0.2, 0.2))
    solids = [Solid(box, Pose3.planar(Pose2(x, 0.0, 0.0), z)) for x, z in ((0.0, 0.5), (1.0, 0.5), (2.0, 3.0))]
    for _ in range(2):  # the second result is cached
        first, second = (Polygon(outline).bounds for outline in outlines_in_z_range(solids, (0.0, 1.0)))
        assert (first, second) == (pytest.approx((-0.2, -0.1, 0.2, 0.1)), pytest.approx((0.8, -0.1, 1.2, 0.1)))
    assert len(outlines_in_z_range(solids, (0.0, 4.0))) == 3
