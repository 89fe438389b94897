import pytest
from playground import shipped
from shapely.geometry import Point, Polygon

from simscen.core.errors import InvalidInput
from simscen.core.geometry.shapes import Sphere
from simscen.model.robot import RobotSpec
from simscen.sim.body.from_spec import build_robot_body

NAMES = ["turtlebot", "amr", "jackal", "car", "omni"]


def changed(name, **more):
    return RobotSpec.model_validate({**shipped(name).model_dump(), **more})


@pytest.mark.parametrize("name", NAMES)
def test_the_whole_robot_weighs_what_its_specification_says(name):
    assert build_robot_body(shipped(name)).mass == pytest.approx(shipped(name).mass)


@pytest.mark.parametrize("name", NAMES)
def test_the_footprint_is_counterclockwise_and_holds_the_base(name):
    outline = Polygon(build_robot_body(shipped(name)).footprint)
    assert outline.exterior.is_ccw
    assert outline.contains(Point(0, 0))


def test_a_round_robot_has_a_radius_and_a_polygon_with_its_corners_on_it():
    body = build_robot_body(shipped("turtlebot"))
    assert body.radius == 0.22
    assert body.circumscribed_radius == pytest.approx(0.22)


def test_a_footprint_that_is_given_rules_over_the_shapes():
    corners = [[0.5, -0.4], [-0.5, -0.4], [-0.5, 0.4], [0.5, 0.4]]
    body = build_robot_body(changed("amr", footprint=corners))
    assert sorted(map(list, body.footprint)) == sorted(corners)
    assert Polygon(body.footprint).exterior.is_ccw


def test_wheels_that_stick_out_are_part_of_the_hull_and_hidden_ones_are_not():
    assert [solid.name for solid in build_robot_body(shipped("jackal")).hull].count("wheel") == 4
    assert [solid.name for solid in build_robot_body(shipped("turtlebot")).hull].count("wheel") == 0


@pytest.mark.parametrize("name", NAMES)
def test_the_lidar_of_a_shipped_robot_sees_others_of_its_kind(name):
    plane = shipped(name).sensors["lidar"].lidar.mount.z
    tall = [(part.z, part.z + (part.box[2] if part.box else part.cylinder[1])) for part in shipped(name).body]
    assert any(bottom + 0.02 <= plane <= top - 0.02 for bottom, top in tall)


def test_two_wheels_get_casters_within_the_hull_of_which_one_carries():
    body = build_robot_body(shipped("amr"))
    lowest = sorted(caster.pose.z - caster.shape.radius for caster in body.casters if isinstance(caster.shape, Sphere))
    assert lowest == pytest.approx([0.0, 0.001])
    assert all(Polygon(body.footprint).contains(Point(c.pose.x, c.pose.y)) for c in body.casters)


def test_the_base_frame_of_a_car_is_under_its_rear_axle():
    wheels = build_robot_body(shipped("car")).wheels
    assert [(wheel.x, wheel.is_steered, wheel.is_driven) for wheel in wheels] == [
        (0.0, False, True), (0.0, False, True), (0.45, True, False), (0.45, True, False)]  # fmt: skip


def test_a_hull_on_the_ground_is_refused_since_it_would_drag():
    with pytest.raises(InvalidInput, match="reaches the ground"):
        build_robot_body(changed("amr", body=[{"box": [0.9, 0.6, 0.2]}]))


def test_a_body_of_any_polygon_drives(simulate):
    corners = [[-0.3, -0.2], [0.3, -0.2], [0.4, 0.0], [0.3, 0.2], [-0.3, 0.2]]
    spec = changed("amr", body=[{"polygon": corners, "height": 0.3, "z": 0.04}, {"box": [0.2, 0.2, 0.1], "z": 0.34}])
    simulation = simulate(build_robot_body(spec), drive=(0.5, 0.0, 0.0))
    simulation.step(480)
    assert simulation.truth().twist.vx == pytest.approx(0.5, rel=0.01)
