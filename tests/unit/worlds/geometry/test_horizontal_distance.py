"""Tests of the horizontal distance from a point to a mesh at the height of the robot."""

import math

import numpy as np
import pytest
import shapely

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cone, Extrusion, Solid, Sphere
from simscen.worlds.geometry.mesh_overlaps import horizontal_distance
from simscen.worlds.geometry.triangulation import merge_solids

BODY = (0.05, 0.4)


def test_sphere_blocks_with_its_part_below_the_top_of_the_robot():
    ball = merge_solids([Solid(Sphere(1.0), Pose3(0, 0, 1.0))])
    assert horizontal_distance(ball, (2.0, 0.0), (0.05, 0.4)) == pytest.approx(2 - math.sqrt(1 - 0.6**2), abs=0.001)
    assert horizontal_distance(ball, (0.0, 0.0), (0.05, 0.4)) == 0.0
    assert horizontal_distance(ball, (0.0, 0.0), (2.1, 3.0)) == math.inf


def test_point_under_the_low_part_of_a_slope_is_inside():
    ramp = merge_solids([Solid(Box((2.0, 1.0, 0.01)), Pose3.from_rpy(0, 0, 0.5, 0, -math.pi / 6, 0))])
    # The sheet rises by 1 m over 1.73 m in the plane; it is 0.4 m high at x = -0.17 m.
    assert horizontal_distance(ramp, (-0.4, 0.0), BODY) == 0.0
    assert horizontal_distance(ramp, (0.5, 0.0), BODY) == pytest.approx(0.5 + 0.1 * math.sqrt(3), abs=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_distances_agree_with_shapely(seed):
    rng = np.random.default_rng(seed)
    corners = ((0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2))
    pose = Pose2(*rng.uniform(-2, 2, 2), rng.uniform(-3, 3))
    polygon = shapely.Polygon(pose.apply(np.array(corners, dtype=float)))
    mesh = merge_solids([Solid(Extrusion(corners, 1.0), Pose3.planar(pose))])
    for x, y in rng.uniform(-5, 5, (30, 2)):
        assert horizontal_distance(mesh, (x, y), BODY) == pytest.approx(polygon.distance(shapely.Point(x, y)), abs=1e-9)


def test_tilted_cone_blocks_with_its_part_at_the_height_of_the_robot():
    cone = merge_solids([Solid(Cone(0.5, 2.0), Pose3.from_rpy(0, 0, 0.5, 1.1, 0.3, 0.2))])
    rng = np.random.default_rng(4)
    slab = cone.vertices[cone.faces]
    for x, y in rng.uniform(-2, 2, (10, 2)):
        samples = []  # brute force: sample every triangle densely, keep what is in the slab
        for a in np.linspace(0, 1, 40):
            for b in np.linspace(0, 1 - a, 40):
                samples.append(slab[:, 0] * (1 - a - b) + slab[:, 1] * a + slab[:, 2] * b)
        points = np.concatenate(samples)
        points = points[(points[:, 2] >= BODY[0]) & (points[:, 2] <= BODY[1])]
        brute = np.hypot(points[:, 0] - x, points[:, 1] - y).min()
        distance = horizontal_distance(cone, (x, y), BODY)
        assert distance == 0.0 or distance == pytest.approx(brute, abs=0.01)
        assert distance <= brute + 1e-9
