"""Tests of the clearance field of a world."""

import numpy as np
import pytest
import shapely

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Solid, Sphere
from simscen.worlds.geometry.cross_section import MAX_SECTIONS, sections_between
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.routes.clearance import clearance_field

BOUNDS, BODY = (-3.0, -3.0, 3.0, 3.0), (0.03, 0.4)


def random_boxes(seed):
    rng = np.random.default_rng(seed)
    solids, polygons = [], []
    for x, y, yaw in rng.uniform(-2.5, 2.5, (6, 3)):
        width, depth = rng.uniform(0.1, 1.5, 2)
        solids.append(Solid(Box((width, depth, 1.0)), Pose3.planar(Pose2(x, y, yaw), 0.5)))
        corners = np.array([(-width, -depth), (width, -depth), (width, depth), (-width, depth)]) / 2
        polygons.append(shapely.Polygon(Pose2(x, y, yaw).apply(corners)))
    return merge_solids(solids), shapely.union_all(polygons)


@pytest.mark.parametrize("seed", range(4))
def test_clearance_agrees_with_shapely_outside_and_is_negative_inside(seed):
    mesh, reference = random_boxes(seed)
    field = clearance_field(mesh, empty_grid(BOUNDS, 0.05), BODY)
    points = np.random.default_rng(seed).uniform(-2.9, 2.9, (3000, 2))
    exact = reference.distance(shapely.points(points))
    deep_inside = reference.buffer(-0.04).distance(shapely.points(points)) == 0
    outside = exact > 0.04
    assert np.abs(field.clearance_at(points) - exact)[outside].max() < 0.0015
    assert (field.clearance_at(points)[deep_inside] < 0).all()
    for distance in (0.1, 0.25, 0.6):
        assert np.array_equal(field.has_clearance(points, distance), field.clearance_at(points) >= distance)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("distance", [0.04, 0.25, 0.6])
def test_free_cells_are_those_whose_center_has_the_clearance(seed, distance):
    mesh, _ = random_boxes(seed)
    field = clearance_field(mesh, empty_grid(BOUNDS, 0.05), BODY)
    centers = field.grid.center_of(np.argwhere(np.ones(field.grid.shape, dtype=bool)))
    expected = (field.clearance_at(centers) >= distance).reshape(field.grid.shape)
    assert np.array_equal(field.free_cells(distance), expected)


def test_points_are_pushed_off_the_nearest_solid():
    wall = merge_solids([Solid(Box((0.2, 8.0, 1.0)), Pose3(0, 0, 0.5))])
    field = clearance_field(wall, empty_grid(BOUNDS, 0.05), BODY)
    points = np.array([[0.3, 0.0], [-0.2, 1.0], [0.05, 0.0], [0.5, 0.0], [2.0, 0.0]])
    expected = np.array([[0.1, 0], [-0.2, 0], [0.35, 0], [0, 0], [0, 0]])
    assert field.push_away(points, 0.3) == pytest.approx(expected, abs=0.001)


def test_clearance_is_large_everywhere_in_an_empty_world():
    field = clearance_field(merge_solids([]), empty_grid(BOUNDS, 0.05), BODY)
    assert field.has_clearance(np.zeros((3, 2)), 100.0).all()
    assert field.free_cells(100.0).all()


def test_upright_solids_need_one_cross_section():
    upright = merge_solids([Solid(Box((1, 1, 1)), Pose3(z=0.5)), Solid(Cylinder(0.3, 2.0), Pose3(3, 0, 1.0))])
    assert len(sections_between(upright, BODY)) == 1
    assert len(sections_between(merge_solids([Solid(Sphere(0.5), Pose3(z=0.5))]), BODY)) == MAX_SECTIONS


def test_thin_shelf_within_the_height_of_the_robot_is_an_obstacle():
    shelf = merge_solids([Solid(Box((1, 1, 0.02)), Pose3(0, 0, 0.25)), Solid(Box((5, 0.1, 1.0)), Pose3(0, 2, 0.5))])
    field = clearance_field(shelf, empty_grid(BOUNDS, 0.05), BODY)
    assert field.clearance_at(np.array([[0.0, 0.0]]))[0] < 0
