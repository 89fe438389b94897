"""Tests of robot bodies that are built from robot specifications."""

import pytest
from shapely.geometry import Point, Polygon
from simulation_helpers import robot_spec

from simscen.core.errors import InvalidInput
from simscen.core.geometry.shapes import Sphere
from simscen.model.robot import RobotSpec
from simscen.sim.body.from_spec import build_robot_body

NAMES = ["turtlebot", "amr", "jackal", "car", "omni"]


def spec_with(name, **fields):
    return RobotSpec.model_validate({**robot_spec(name).model_dump(), **fields})


@pytest.mark.parametrize("name", NAMES)
def test_body_has_the_specified_mass(name):
    assert build_robot_body(robot_spec(name)).mass == pytest.approx(robot_spec(name).mass)


@pytest.mark.parametrize("name", NAMES)
def test_footprint_is_counterclockwise_and_contains_the_base(name):
    outline = Polygon(build_robot_body(robot_spec(name)).footprint)
    assert outline.exterior.is_ccw
    assert outline.contains(Point(0, 0))


def test_round_robot_has_its_specified_radius():
    body = build_robot_body(robot_spec("turtlebot"))
    assert body.radius == 0.22
    assert body.circumscribed_radius == pytest.approx(0.22)


def test_specified_footprint_overrides_the_shapes():
    corners = [[0.5, -0.4], [-0.5, -0.4], [-0.5, 0.4], [0.5, 0.4]]
    body = build_robot_body(spec_with("amr", footprint=corners))
    assert sorted(map(list, body.footprint)) == sorted(corners)
    assert Polygon(body.footprint).exterior.is_ccw


def test_only_protruding_wheels_are_part_of_the_hull():
    assert [solid.name for solid in build_robot_body(robot_spec("jackal")).hull].count("wheel") == 4
    assert [solid.name for solid in build_robot_body(robot_spec("turtlebot")).hull].count("wheel") == 0


@pytest.mark.parametrize("name", NAMES)
def test_lidar_of_a_shipped_robot_sees_robots_of_the_same_model(name):
    scan_height = robot_spec(name).sensors["lidar"].lidar.mount.z
    z_ranges = [(part.z, part.z + (part.box[2] if part.box else part.cylinder[1])) for part in robot_spec(name).body]
    assert any(bottom + 0.02 <= scan_height <= top - 0.02 for bottom, top in z_ranges)


def test_two_wheeled_robot_gets_casters_of_which_one_touches_the_ground():
    body = build_robot_body(robot_spec("amr"))
    lowest_points = sorted(
        caster.pose.z - caster.shape.radius for caster in body.casters if isinstance(caster.shape, Sphere)
    )
    assert lowest_points == pytest.approx([0.0, 0.001])
    assert all(Polygon(body.footprint).contains(Point(c.pose.x, c.pose.y)) for c in body.casters)


def test_the_base_frame_of_a_car_is_under_its_rear_axle():
    wheels = build_robot_body(robot_spec("car")).wheels
    assert [(wheel.x, wheel.is_steered, wheel.is_driven) for wheel in wheels] == [
        (0.0, False, True), (0.0, False, True), (0.45, True, False), (0.45, True, False)]  # fmt: skip


def test_hull_that_reaches_the_ground_is_refused():
    with pytest.raises(InvalidInput, match="reaches the ground"):
        build_robot_body(spec_with("amr", body=[{"box": [0.9, 0.6, 0.2]}]))


def test_robot_with_a_polygonal_body_drives(simulate):
    corners = [[-0.3, -0.2], [0.3, -0.2], [0.4, 0.0], [0.3, 0.2], [-0.3, 0.2]]
    spec = spec_with("amr", body=[{"polygon": corners, "height": 0.3, "z": 0.04}, {"box": [0.2, 0.2, 0.1], "z": 0.34}])
    simulation = simulate(build_robot_body(spec), drive=(0.5, 0.0, 0.0))
    simulation.step(480)
    assert simulation.truth().twist.vx == pytest.approx(0.5, rel=0.01)
