"""Tests of the drive, sensors, and limits that are inferred from a URDF."""

import math
from pathlib import Path

import pytest
import trimesh
from simulation_helpers import robot_spec

from simscen.core.errors import InvalidInput
from simscen.loading.builders import read_mesh
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.urdf.inference import infer_robot_spec
from simscen.sim.urdf.writer import to_urdf

JACKAL = Path(__file__).parents[5] / "shared/data/jackal_urdf/jackal.urdf"


@pytest.fixture
def infer(tmp_path):
    """Return a function that infers the robot specification of a URDF text."""

    def infer(text):
        (tmp_path / "robot.urdf").write_text(text)
        return infer_robot_spec(tmp_path / "robot.urdf", [tmp_path])

    return infer


@pytest.mark.parametrize("name", ["turtlebot", "amr", "jackal"])
def test_drive_of_a_shipped_robot_is_inferred_from_its_urdf(infer, name):
    spec = robot_spec(name)
    found = infer(to_urdf(build_robot_body(spec)))
    assert found.drive.type == spec.drive.type
    assert found.drive.wheel_radius == pytest.approx(spec.drive.wheel_radius)
    assert found.drive.wheel_separation == pytest.approx(spec.drive.wheel_separation)
    assert sorted(found.sensors) == ["imu", "lidar", "odom"]


def test_lidar_is_mounted_at_its_link_or_on_top(infer):
    text = to_urdf(build_robot_body(robot_spec("amr")))
    assert infer(text).sensors["lidar"].lidar.mount.z == pytest.approx(0.38 + 0.02)
    link = (
        '<link name="base_scan"/><joint name="s" type="fixed"><parent link="base_link"/><child link="base_scan"/>'
        '<origin xyz="0.3 0.1 0.25" rpy="0 0 0.5"/></joint></robot>'
    )
    mount = infer(text.replace("</robot>", link)).sensors["lidar"].lidar.mount
    assert (mount.x, mount.y, mount.z, mount.yaw) == pytest.approx((0.3, 0.1, 0.25, 0.5))


@pytest.mark.parametrize(("rpy", "roll"), [("3.14159 0 0.5", math.pi), ("0 0 0.5", 0.0), ("0 0.2 0.5", 0.0)])
def test_lidar_is_upside_down_if_its_link_is(infer, rpy, roll):
    """Other tilts are ignored, since the frame of a link need not be that of the scan."""
    link = (
        '<link name="base_scan"/><joint name="s" type="fixed"><parent link="base_link"/><child link="base_scan"/>'
        f'<origin xyz="0.3 0.1 0.25" rpy="{rpy}"/></joint></robot>'
    )
    mount = infer(to_urdf(build_robot_body(robot_spec("amr"))).replace("</robot>", link)).sensors["lidar"].lidar.mount
    assert (mount.roll, mount.pitch) == (roll, 0.0)
    assert mount.yaw == pytest.approx(0.5, abs=1e-4)


def test_velocity_limits_of_wheel_joints_limit_the_robot(infer):
    text = to_urdf(build_robot_body(robot_spec("amr"))).replace(
        '<axis xyz="0 1 0" />', '<axis xyz="0 1 0"/><limit effort="1" velocity="5"/>'
    )
    assert infer(text).limits.linear == pytest.approx(0.5)


def test_wheels_on_a_suspension_are_not_steered(infer):
    text = to_urdf(build_robot_body(robot_spec("turtlebot")))
    for side in ("left", "right"):
        text = text.replace(
            f'<joint name="wheel_{side}" type="continuous">\n    <parent link="base_link" />',
            f'<link name="drop_{side}"/><joint name="drop_{side}" type="prismatic"><parent link="base_link"/>'
            f'<child link="drop_{side}"/><axis xyz="0 0 1"/></joint>'
            f'<joint name="wheel_{side}" type="continuous">\n    <parent link="drop_{side}" />',
        )
    assert text.count("prismatic") == 2
    assert infer(text).drive.type == "differential"


def test_drive_of_a_robot_without_wheels_is_not_inferred(infer):
    with pytest.raises(InvalidInput, match="cannot be inferred from its wheels: the URDF has no movable joints"):
        infer(to_urdf(build_robot_body(robot_spec("omni"))))


def test_urdf_with_a_name_that_is_too_long_is_an_error_at_its_line(infer):
    text = to_urdf(build_robot_body(robot_spec("amr"))).replace('name="amr"', f'name="{"a" * 121}"')
    with pytest.raises(InvalidInput, match="its `name` is not valid: String should have at most 120") as caught:
        infer(text)
    assert caught.value.problems[0].line == 2


def test_single_front_wheel_steers_as_far_as_its_joint(infer):
    tricycle = to_urdf(build_robot_body(robot_spec("turtlebot"))).replace(
        "</robot>",
        '<link name="fork"/><joint name="steer" type="revolute"><parent link="base_link"/><child link="fork"/><origin '
        'xyz="0.3 0 0.033"/><axis xyz="0 0 1"/><limit lower="-0.6" upper="0.6" effort="1" velocity="1"/></joint>'
        '<link name="front"><collision><geometry><sphere radius="0.033"/></geometry></collision>'
        '<inertial><mass value="0.1"/></inertial></link>'
        '<joint name="roll" type="continuous"><parent link="fork"/><child link="front"/><axis xyz="0 1 0"/></joint>'
        "</robot>",
    )
    drive = infer(tricycle).drive
    assert (drive.type, drive.max_steering) == ("ackermann", pytest.approx(0.6))


@pytest.mark.skipif(not JACKAL.exists(), reason="shared/data/jackal_urdf is missing: see CONTRIBUTING.md")
def test_the_jackal_is_skid_steered():
    spec = infer_robot_spec(JACKAL)
    assert spec.drive.type == "skid_steer"
    assert spec.drive.wheel_separation == pytest.approx(0.37559)
    assert spec.drive.wheel_base == pytest.approx(0.262)
    assert spec.drive.turning_scale == pytest.approx(1.584, abs=0.001)
    assert build_robot_body(spec, JACKAL).mass == pytest.approx(18.4, abs=0.1)


SWIVEL = """
  <link name="fork"/><joint name="swivel" type="continuous"><parent link="base_link"/><child link="fork"/>
  <origin xyz="-0.1 0 0.04"/><axis xyz="0 0 1"/></joint>
  <link name="roller"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="roll" type="continuous"><parent link="fork"/><child link="roller"/>
  <origin xyz="TRAIL 0 -0.02"/><axis xyz="0 1 0"/></joint></robot>"""


def test_a_wheel_that_trails_its_steering_axis_is_a_caster(infer):
    text = to_urdf(build_robot_body(robot_spec("turtlebot"))).replace("</robot>", SWIVEL)
    assert infer(text.replace("TRAIL", "-0.015")).drive.type == "differential"
    with pytest.raises(InvalidInput, match="only front steering is simulated"):
        infer(text.replace("TRAIL", "0"))


@pytest.mark.parametrize("stretch", [1.0, 1.2])
def test_wheels_may_be_round_meshes(tmp_path, stretch):
    cylinder = trimesh.creation.cylinder(radius=0.05, height=0.03, sections=48)
    cylinder.apply_scale((stretch, 1.0, 1.0))
    cylinder.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (1, 0, 0)))
    cylinder.apply_translation((0.0, 0.01, 0.0))
    cylinder.export(tmp_path / "wheel.stl")
    wheel = """
  <link name="SIDE"><inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="2e-4" izz="1e-4"/></inertial>
  <collision><geometry><mesh filename="wheel.stl"/></geometry></collision></link>
  <joint name="SIDE_joint" type="continuous"><parent link="base"/><child link="SIDE"/><origin xyz="0 Y 0.05"/>
  <axis xyz="0 1 0"/></joint>"""
    wheels = wheel.replace("SIDE", "left").replace("Y", "0.2") + wheel.replace("SIDE", "right").replace("Y", "-0.2")
    (tmp_path / "robot.urdf").write_text(
        '<robot name="r"><link name="base"><inertial><mass value="5"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'
        '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.4 0.3 0.1"/>'
        f"</geometry></collision></link>{wheels}</robot>"
    )
    if stretch != 1.0:
        with pytest.raises(InvalidInput, match="cannot be inferred"):
            infer_robot_spec(tmp_path / "robot.urdf", [tmp_path], read_mesh)
        return
    drive = infer_robot_spec(tmp_path / "robot.urdf", [tmp_path], read_mesh).drive
    assert drive.type == "differential"
    assert drive.wheel_radius == pytest.approx(0.05, rel=0.01)
    assert drive.wheel_width == pytest.approx(0.03)
    assert drive.wheel_separation == pytest.approx(0.4)


def add_joint(text, replacements):
    """Add a joint and its link to a URDF; the link is a short cylinder along y.

    `replacements` are texts of the joint and their replacements. COLLISION and TYPE stand for the shape of the link
    and the type of the joint.
    """
    link = (
        '<link name="part">COLLISION<inertial><mass value="0.1"/></inertial></link><joint name="extra" TYPE>'
        '<parent link="base_link"/><child link="part"/><origin xyz="0.1 0.05 0.35"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    cylinder = (
        '<collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.02" length="0.04"/></geometry></collision>'
    )
    for old, new in replacements.items():
        link = link.replace(old, new)
    return text.replace("</robot>", link.replace("COLLISION", cylinder).replace("TYPE", 'type="continuous"'))


@pytest.mark.parametrize("name", ["turtlebot", "jackal"])
@pytest.mark.parametrize("height", ["0.35", "0.08"])
def test_round_links_above_the_ground_are_not_wheels(infer, name, height):
    """Regression: a tilting camera made a robot unusable, two rollers of a belt made it a skid-steer robot."""
    text = to_urdf(build_robot_body(robot_spec(name)))
    assert infer(add_joint(text, {"0.35": height})).drive == infer(text).drive


def test_small_rollers_on_the_ground_are_not_driven(infer):
    text = to_urdf(build_robot_body(robot_spec("turtlebot")))
    radius = infer(text).drive.wheel_radius
    roller = {"0.1 0.05 0.35": "-0.1 0 0.02"}
    assert infer(add_joint(text, roller)).drive.wheel_radius == radius


@pytest.mark.parametrize(("limit", "drive"), [("1e+16", "differential"), ("40", "differential"), ("6.3", None)])
def test_revolute_joints_with_limits_of_many_turns_are_wheels(infer, limit, drive):
    text = to_urdf(build_robot_body(robot_spec("amr"))).replace('type="continuous"', 'type="revolute"')
    text = text.replace('<axis xyz="0 1 0" />', f'<axis xyz="0 1 0"/><limit lower="-{limit}" upper="{limit}"/>')
    if drive:
        assert infer(text).drive.type == drive
    else:
        with pytest.raises(InvalidInput, match=r"not wheels: .* \(revolute joint with limits\)"):
            infer(text)


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ({"TYPE": 'type="revolute"'}, "revolute joint with limits"),
        ({"TYPE": 'type="prismatic"'}, "prismatic joint"),
        ({"0 1 0": "1 0 0"}, "axis along x, not y"),
        ({"0 1 0": "1 1 0"}, "axis not along y"),
        ({"COLLISION": ""}, "no collision shape"),
        ({"COLLISION": '<collision><geometry><box size="1 1 1"/></geometry></collision>'}, "no round collision shape"),
    ],
)
def test_the_reason_is_given_for_each_joint_without_a_wheel(infer, joint, reason):
    with pytest.raises(InvalidInput) as error:
        infer(add_joint(to_urdf(build_robot_body(robot_spec("omni"))), joint))
    assert error.value.problems[0].message.endswith(f": left: none; right: none; not wheels: extra ({reason})")


def test_wheels_on_one_side_are_named(infer):
    text = to_urdf(build_robot_body(robot_spec("turtlebot"))).replace(
        '<joint name="wheel_right" type="continuous">', '<joint name="wheel_right" type="fixed">'
    )
    with pytest.raises(InvalidInput, match=r"left: wheel_left; right: none$"):
        infer(text)


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
MACRO = '<xacro:macro name="robot" params="x"><link name="base_link"/></xacro:macro>'
LOOP = (
    '<link name="a"/><link name="b"/><joint name="i" type="fixed"><parent link="a"/><child link="b"/></joint>'
    '<joint name="j" type="fixed"><parent link="b"/><child link="a"/></joint>'
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (MACRO, "the file defines macros but does not use them"),
        ("", "expected one root link, found no <link>"),
        (LOOP, "expected one root link, found a loop of joints"),
    ],
)
def test_file_without_a_root_link_is_refused_with_its_reason(infer, content, message):
    with pytest.raises(InvalidInput) as error:
        infer(XACRO.format(content))
    assert error.value.problems[0].message == message


def car(limit):
    """Return the URDF of a turtlebot with two steered wheels in front."""
    front = """
  <link name="SIDE_knuckle"/><joint name="SIDE_steering" type="revolute"><parent link="base_link"/>
  <child link="SIDE_knuckle"/><origin xyz="0.3 Y 0.033"/><axis xyz="0 0 1"/>LIMIT</joint>
  <link name="SIDE_front"><collision><geometry><sphere radius="0.033"/></geometry></collision>
  <inertial><mass value="0.1"/></inertial></link>
  <joint name="SIDE_rolling" type="continuous"><parent link="SIDE_knuckle"/><child link="SIDE_front"/>
  <axis xyz="0 1 0"/></joint>""".replace("LIMIT", limit)
    wheels = front.replace("SIDE", "left").replace("Y", "0.14") + front.replace("SIDE", "right").replace("Y", "-0.14")
    return to_urdf(build_robot_body(robot_spec("turtlebot"))).replace("</robot>", f"{wheels}</robot>")


@pytest.mark.parametrize(
    ("lower", "upper", "inner"), [(-0.7, 0.7, 0.7), (-0.7, 0.4, 0.4), (-1.3, 1.3, 1.0), (-0.01, 0.01, 0.1)]
)
def test_limits_of_the_steering_joints_limit_the_inner_wheel(infer, lower, upper, inner):
    drive = infer(car(f'<limit lower="{lower}" upper="{upper}"/>')).drive
    radius = drive.wheel_base / math.tan(drive.max_steering)
    assert math.atan(drive.wheel_base / (radius - 0.14)) == pytest.approx(inner)


@pytest.mark.parametrize("limit", ["", '<limit lower="-3.2" upper="3.2"/>', '<limit effort="1"/>'])
def test_car_without_limits_of_its_steering_joints_has_the_default_limit(infer, limit):
    assert infer(car(limit)).drive.max_steering == 0.5
