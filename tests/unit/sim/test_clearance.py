"""Tests of clearance against closed forms."""

import math

import pytest
from shapely.geometry import Point, Polygon
from shapely.geometry import box as rectangle
from shapely.ops import unary_union
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, Box, Cylinder, Extrusion, MotionPath, Solid, Sphere
from simscen.core.records.case import CLEARANCE_RANGE_M

RADIUS = 0.22  # of the turtlebot
MILLIMETER = 1e-3


def test_clearance_in_an_empty_world_is_the_search_range(simulate):
    assert simulate().truth().clearance == CLEARANCE_RANGE_M


def test_clearance_is_limited_to_the_requested_range(simulate):
    wall = box("wall", RADIUS + 3.0 + 0.05, 0, 0.1, 4)
    assert simulate(solids=[wall], clearance_range=3.5).truth().clearance == pytest.approx(3.0, abs=MILLIMETER)
    assert simulate(solids=[wall], clearance_range=2.5).truth().clearance == 2.5


@pytest.mark.parametrize("gap", [0.001, 0.02, 0.3, 1.0, 1.9])
def test_clearance_of_a_round_robot_to_a_wall(simulate, gap):
    wall = box("wall", RADIUS + gap + 0.05, 0, 0.1, 4)
    assert simulate(solids=[wall]).truth().clearance == pytest.approx(gap, abs=MILLIMETER)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.2])
def test_clearance_of_a_round_robot_to_a_corner(simulate, yaw):
    corner = box("corner", 1.0, 1.0, 0.4, 0.4, yaw=yaw)
    edges = Polygon([(x, y) for x, y in _corners(1.0, 1.0, 0.4, 0.4, yaw)])
    expected = edges.distance(Point(0, 0)) - RADIUS
    assert simulate(solids=[corner]).truth().clearance == pytest.approx(expected, abs=MILLIMETER)


def test_clearance_of_a_round_robot_to_a_post(simulate):
    post = Solid(Cylinder(0.15, 1.0), Pose3(0.6, 0.8, 0.5), "post")
    assert simulate(solids=[post]).truth().clearance == pytest.approx(1.0 - 0.15 - RADIUS, abs=MILLIMETER)


@pytest.mark.parametrize("yaw", [0.0, 0.3, 0.8, 1.5])
def test_clearance_of_a_rectangular_robot_between_boxes(simulate, yaw):
    rectangles = [(1.2, 0.7, 0.5, 0.3, 0.2), (-0.9, -0.6, 0.2, 0.2, 0.9), (0.2, 1.1, 1.0, 0.1, 0.0)]
    solids = [box(f"box{k}", *values[:4], yaw=values[4]) for k, values in enumerate(rectangles)]
    hull = Polygon(_corners(0, 0, 0.9, 0.6, yaw))
    expected = hull.distance(unary_union([Polygon(_corners(*values)) for values in rectangles]))
    simulation = simulate("amr", solids, pose=Pose2(0.0, 0.0, yaw))
    assert simulation.truth().clearance == pytest.approx(expected, abs=MILLIMETER)


def test_clearance_counts_movable_objects_but_not_the_ground(simulate):
    cart = Body("cart", (box("cart", 0, 0, 0.4, 0.4),), Pose3(1.0, 0.0))
    simulation = simulate(bodies=[cart])
    assert simulation.truth().clearance == pytest.approx(0.8 - RADIUS, abs=MILLIMETER)
    simulation.remove("cart")
    assert simulation.truth().clearance == CLEARANCE_RANGE_M
    simulation.spawn(Body("prism", (Solid(Extrusion(((-0.1, -1), (0.1, -1), (0.1, 1), (-0.1, 1)), 0.5)),), Pose3(0.7)))
    assert simulation.truth().clearance == pytest.approx(0.6 - RADIUS, abs=MILLIMETER)


def test_clearance_counts_distant_objects_as_soon_as_they_come_near(simulate):
    """Distant objects are skipped for a while, but not when a path or a push brings one near."""
    path = MotionPath((0.0, 10.0), (Pose2(0.0, 9.0), Pose2(0.0, 1.0)))
    cart = Body("cart", (box("cart", 0, 0, 0.4, 0.4),), Pose3(0.0, 9.0), path=path)
    ball = Body("ball", (Solid(Sphere(0.15)),), Pose3(8.0, 0.0, 0.15), 1.0)
    simulation, nearest = simulate(bodies=[cart, ball]), []
    for tick in range(0, 240 * 12, 6):
        if tick == 240 * 6:  # the ball has fallen asleep
            simulation.push_object("ball", (-2.0, 0.0))
        simulation.step(6)
        truth = simulation.truth()
        x, y = truth.objects["ball"].x, truth.objects["cart"].y
        gap = min(x - 0.15 - RADIUS, y - 0.2 - RADIUS, CLEARANCE_RANGE_M)
        nearest.append(gap)
        if gap > 0.3:
            assert truth.clearance == pytest.approx(gap, abs=5e-3)
    assert min(nearest[: 40 * 6]) == CLEARANCE_RANGE_M
    assert min(nearest) < 0.3


def test_sleeping_object_has_the_extents_of_its_pose(simulate):
    """The fallen post is nearer to the robot than the wall and the upright post."""
    post = (Solid(Box((0.2, 0.2, 2.4)), Pose3(), "post"),)
    fallen = Body("fallen", post, Pose3.from_rpy(0.0, 2.0, 0.1, math.pi / 2, 0.0, 0.0), mass=20.0)
    upright = Body("upright", post, Pose3(0.0, -2.0, 1.2), mass=20.0)
    simulation = simulate(solids=[box("wall", RADIUS + 0.95, 0, 0.1, 4)], bodies=[fallen, upright])
    simulation.step(1200)
    assert simulation.truth().clearance == pytest.approx(0.8 - RADIUS, abs=2 * MILLIMETER)
    simulation.remove("fallen")
    simulation.step(1200)
    assert simulation.truth().clearance == pytest.approx(0.9, abs=MILLIMETER)


def test_clearance_is_negative_where_hull_and_obstacle_overlap(simulate):
    wall = box("wall", RADIUS - 0.01 + 0.05, 0, 0.1, 4)
    assert simulate(solids=[wall]).truth().clearance == pytest.approx(-0.01, abs=MILLIMETER)


def test_clearance_to_an_overhead_obstacle_is_vertical(simulate):
    shelf = Solid(box("shelf", 0, 0, 2, 2, 0.1).shape, Pose3(z=0.75), "shelf")
    assert simulate(solids=[shelf]).truth().clearance == pytest.approx(0.7 - 0.21, abs=MILLIMETER)


def test_clearance_while_driving_equals_the_planar_distance(simulate):
    solids = [box(f"box{k}", x, y, 0.4, 0.3) for k, (x, y) in enumerate([(1.5, 0.8), (2.5, -0.7), (3.5, 0.6)])]
    shapes = unary_union([rectangle(*rect) for rect in [(1.3, 0.65, 1.7, 0.95), (2.3, -0.85, 2.7, -0.55),
                                                        (3.3, 0.45, 3.7, 0.75)]])  # fmt: skip
    simulation = simulate(solids=solids, drive=(0.5, 0.0, 0.0))
    for _ in range(320):
        simulation.step(6)
        truth = simulation.truth()
        expected = min(CLEARANCE_RANGE_M, shapes.distance(Point(truth.pose.x, truth.pose.y)) - RADIUS)
        assert truth.clearance == pytest.approx(expected, abs=MILLIMETER)


def _corners(x, y, length, width, yaw):
    """Return the corners of a rotated rectangle around (x, y)."""
    c, s = math.cos(yaw), math.sin(yaw)
    half = [(a * length / 2, b * width / 2) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return [(x + c * u - s * v, y + s * u + c * v) for u, v in half]


def test_wheel_spheres_do_not_touch_a_wall_beside_the_hull(simulate):
    """A Jackal drives 3 cm beside a wall, less than the radius of the spheres that model its wheels."""
    without_wall = simulate("jackal", drive=(1.0, 0.0, 0.0))
    with_wall = simulate("jackal", solids=[box("wall", 0, -(0.2078 + 0.03 + 0.05), 10, 0.1)], drive=(1.0, 0.0, 0.0))
    for simulation in (without_wall, with_wall):
        simulation.step(480)
    assert with_wall.truth().pose.x == pytest.approx(without_wall.truth().pose.x, abs=1e-3)
    assert with_wall.robot.collisions() == ()
