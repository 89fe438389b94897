"""Tests of robots from URDF files, and of invalid URDFs."""

import os
import struct

import numpy as np
import pytest

from simscen.core.errors import InvalidInput
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Box, Mesh
from simscen.model.robot import RobotSpec
from simscen.sim.body.from_spec import build_robot_body
from simscen.worlds.sdf.mesh_files import UnusableMesh, read_parts
from tests.single_robot import SingleRobotSimulation

DIFFERENTIAL = {"type": "differential", "wheel_radius": 0.05, "wheel_separation": 0.4}
LIMITS = {"linear": 0.5, "angular": 2.0, "linear_acceleration": 1.0, "angular_acceleration": 3.0}

WHEEL = """
  <link name="{side}">
    <collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.05" length="0.03"/></geometry></collision>
    <inertial><mass value="0.3"/><inertia ixx="0.0002" iyy="0.0004" izz="0.0002"/></inertial>
  </link>
  <joint name="{side}_joint" type="continuous">
    <parent link="base"/><child link="{side}"/><origin xyz="0.1 {y} 0"/><axis xyz="0 1 0"/>
  </joint>"""
FRONT_WHEEL = WHEEL.replace('link="base"', 'link="knuckle_{side}"').replace("0.1 {y} 0", "0 0 0").replace(
    'name="{side}', 'name="front_{side}').replace('link="{side}"', 'link="front_{side}"')  # fmt: skip
BASE = """
  <link name="base">
    <visual><geometry><mesh filename="package://missing/visual.dae"/></geometry></visual>
    <collision><origin xyz="0.05 0 0.1"/><geometry>{geometry}</geometry></collision>
    <inertial><origin xyz="0.05 0 0.05"/><mass value="4"/><inertia ixx="0.05" iyy="0.06" izz="0.08"/></inertial>
  </link>"""
BOX = '<box size="0.5 0.36 0.2"/>'


def robot(geometry=BOX, extra="", base=BASE):
    """Return the URDF of a cart with two wheels; `extra` are further links and joints."""
    wheels = "".join(WHEEL.format(side=side, y=y) for side, y in (("left", 0.2), ("right", -0.2)))
    return f'<?xml version="1.0"?>\n<robot name="cart">{base.format(geometry=geometry)}{wheels}{extra}\n</robot>\n'


def spec(drive=DIFFERENTIAL, urdf="robot.urdf", **fields):
    """Return the specification of a robot with a URDF file."""
    return RobotSpec.model_validate(
        {"simscen": 1, "name": "cart", "urdf": urdf, "drive": drive, "limits": LIMITS, "sensors": {}, **fields}
    )


def read_mesh(path):
    try:
        parts = read_parts(path.read_bytes(), path.suffix)
    except UnusableMesh as error:
        raise ValueError(str(error)) from error
    return Mesh(parts[0].vertices, parts[0].faces.astype("int32"))


@pytest.fixture
def load(tmp_path):
    """Return a function that builds the robot body of a URDF text."""

    def load(text, **fields):
        (tmp_path / "robot.urdf").write_bytes(text if isinstance(text, bytes) else text.encode())
        return build_robot_body(spec(**fields), tmp_path / "cart.robot.yaml", [tmp_path], read_mesh)

    return load


@pytest.fixture
def refusal(load):
    """Return a function that returns the first problem of an invalid URDF text."""

    def refusal(text, **fields):
        with pytest.raises(InvalidInput) as caught:
            load(text, **fields)
        return caught.value.problems[0]

    return refusal


def line_of(text, piece):
    return text[: text.index(piece)].count("\n") + 1


def test_the_base_frame_is_on_the_ground_under_the_middle_of_the_axle(load):
    body = load(robot())
    (hull,) = (solid for solid in body.hull if solid.name == "base")
    assert hull.shape == Box((0.5, 0.36, 0.2))
    assert hull.pose.position == pytest.approx((-0.05, 0.0, 0.15))
    assert [(w.name, w.x, w.y, w.radius) for w in body.wheels] == [
        ("left_joint", pytest.approx(0), pytest.approx(0.2), 0.05),
        ("right_joint", pytest.approx(0), pytest.approx(-0.2), 0.05),
    ]
    assert body.mass == pytest.approx(4.6)
    assert body.chassis.center == pytest.approx([-0.05, 0.0, 0.1])


def test_specified_mass_overrides_that_of_the_urdf(load):
    assert load(robot(), mass=46.0).mass == pytest.approx(46.0)


def test_missing_meshes_of_visuals_are_ignored(load):
    assert "missing" in robot()
    assert load(robot()).hull


def test_fixed_links_become_part_of_the_hull(load):
    mast = """
  <link name="mast"><collision><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
  <joint name="up" type="fixed"><parent link="base"/><child link="mast"/><origin xyz="0.1 0 0.4"/></joint>"""
    body = load(robot(extra=mast))
    (solid,) = (solid for solid in body.hull if solid.name == "mast")
    assert solid.pose.position == pytest.approx((0.0, 0.0, 0.45))


def test_fixed_joints_may_have_an_axis_of_zero(load, refusal):
    text = """<link name="rack"/><joint name="on" type="{}"><parent link="base"/><child link="rack"/>
    <axis xyz="0 0 0"/></joint>"""
    assert load(robot(extra=text.format("fixed"))) is not None
    assert "axis of length 0" in refusal(robot(extra=text.format("revolute"))).message


def test_swivel_casters_of_a_differential_drive_are_not_steered_wheels(load):
    caster = (
        '<link name="fork"/><joint name="swivel" type="continuous"><parent link="base"/><child link="fork"/>'
        '<origin xyz="-0.2 0 -0.02"/><axis xyz="0 0 1"/></joint>'
        + WHEEL.format(side="rear", y=0).replace('link="base"', 'link="fork"').replace("0.05", "0.03")
    )
    body = load(robot(extra=caster))
    assert sum(wheel.is_driven for wheel in body.wheels) == 2
    assert not any(wheel.is_steered for wheel in body.wheels)


def test_casters_of_the_urdf_on_the_ground_are_replaced_by_generated_ones(load):
    caster = """
  <link name="caster"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="c" type="fixed"><parent link="base"/><child link="caster"/><origin xyz="-0.1 0 -0.03"/></joint>"""
    body = load(robot(extra=caster))
    assert "caster" not in [solid.name for solid in body.hull]
    assert len(body.casters) == 2


ROUND_CASTER = """
  <link name="caster"><collision><geometry>{geometry}</geometry></collision></link>
  <joint name="c" type="fixed">
    <parent link="base"/><child link="caster"/><origin xyz="-0.02 0 {z}" rpy="{rpy}"/>
  </joint>"""
BALL, ROLLER = '<sphere radius="{}"/>', '<cylinder radius="{}" length="{}"/>'


@pytest.mark.parametrize("geometry", [BALL.format(0.05), ROLLER.format(0.05, 0.1)])
def test_a_round_caster_as_large_as_the_wheels_may_be_wide_for_a_small_robot(load, geometry):
    caster = ROUND_CASTER.format(geometry=geometry, z=0, rpy="1.57 0 0")
    body = load(robot('<box size="0.2 0.2 0.2"/>', extra=caster))
    assert [solid.name for solid in body.hull if isinstance(solid.shape, Box)] == ["base", "wheel", "wheel"]
    assert not any(solid.name == "caster" and solid.shape.radius == 0.05 for solid in body.hull)


@pytest.mark.parametrize(
    ("geometry", "z", "rpy"),
    [
        (BALL.format(0.06), 0.01, "0 0 0"),  # larger than the wheels
        (ROLLER.format(0.05, 0.15), 0, "1.57 0 0"),  # longer than its diameter
        (ROLLER.format(0.05, 0.1), 0, "0 0 0"),  # stands on its base
    ],
)
def test_a_wide_part_that_does_not_roll_like_a_caster_is_refused_on_a_small_robot(refusal, geometry, z, rpy):
    extra = ROUND_CASTER.format(geometry=geometry, z=z, rpy=rpy)
    assert "link 'caster'" in refusal(robot('<box size="0.2 0.2 0.2"/>', extra=extra)).message


def test_urdf_robot_drives(load):
    simulation = SingleRobotSimulation(load(robot()))
    simulation.drive(Twist(0.5, 0.0, 0.0))
    simulation.step(240)
    start = simulation.truth().pose.x
    simulation.step(480)
    assert simulation.truth().pose.x - start == pytest.approx(1.0, rel=0.01)
    simulation.close()


def test_meshes_are_part_of_the_hull_as_their_convex_hull(load, tmp_path):
    (tmp_path / "tetra.stl").write_bytes(stl(4))
    body = load(robot(extra="", geometry='<mesh filename="tetra.stl" scale="0.001 0.001 0.001"/>'))
    (solid,) = (solid for solid in body.hull if solid.name == "base")
    assert solid.shape.vertices.max() == pytest.approx(0.3)
    simulation = SingleRobotSimulation(body)
    simulation.step(10)
    simulation.close()


def stl(triangle_count):
    """Return a binary STL file of four triangles, whose header says `triangle_count`."""
    corners = [(0, 0, 0), (300, 0, 0), (0, 300, 0), (0, 0, 300)]
    data = b"\0" * 80 + struct.pack("<I", triangle_count)
    for a, b, c in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        data += struct.pack("<12fH", 0, 0, 1, *corners[a], *corners[b], *corners[c], 0)
    return data


def test_a_missing_mesh_is_named_with_its_line(refusal):
    text = robot('<mesh filename="meshes/base.stl"/>')
    problem = refusal(text)
    assert (problem.path, problem.line) == ("robot.urdf", line_of(text, "meshes/base.stl"))
    assert "meshes/base.stl" in problem.message
    assert "no such file" in problem.message


@pytest.mark.parametrize(
    ("uri", "reason"),
    [
        ("../secret.stl", "outside the scenario root"),
        ("/etc/passwd", "absolute paths are not read"),
        ("package://robot/base.stl", "there is no package 'robot'"),
        ("model://robot/base.stl", "there is no package 'robot'"),
        ("file:///etc/passwd", "absolute paths are not read"),
        ("http://example.org/base.stl", "only model://, package://, file://, Fuel and relative paths are read"),
    ],
)
def test_meshes_outside_the_root_are_not_opened(refusal, uri, reason):
    problem = refusal(robot(f'<mesh filename="{uri}"/>'))
    assert reason in problem.message
    assert problem.line > 1


@pytest.mark.parametrize("uri", ["package://cart/base.stl", "model://cart/base.stl", "file://cart/base.stl"])
def test_mesh_is_found_by_every_uri_scheme_that_worlds_support(refusal, tmp_path, uri):
    (tmp_path / "cart").mkdir()
    (tmp_path / "cart" / "base.stl").write_bytes(stl(4000))
    assert "STL header says" in refusal(robot(f'<mesh filename="{uri}"/>')).message


def test_a_symbolic_link_out_of_the_root_is_not_followed(refusal, tmp_path):
    (tmp_path / "base.stl").symlink_to("/etc/passwd")
    assert "outside the scenario root" in refusal(robot('<mesh filename="base.stl"/>')).message


def test_a_folder_instead_of_a_urdf_is_refused(tmp_path):
    (tmp_path / "robot.urdf").mkdir()
    with pytest.raises(InvalidInput, match="not a regular file"):
        build_robot_body(spec(), tmp_path / "cart.robot.yaml", [tmp_path])


def test_a_named_pipe_instead_of_a_mesh_is_refused(refusal, tmp_path):
    os.mkfifo(tmp_path / "base.stl")
    assert "not a regular file" in refusal(robot('<mesh filename="base.stl"/>')).message


def test_wrong_number_of_triangles_is_reported(refusal, tmp_path):
    (tmp_path / "base.stl").write_bytes(stl(4000))
    assert "STL header says 4000 triangles, file holds 4" in refusal(robot('<mesh filename="base.stl"/>')).message


def test_a_doctype_is_refused(refusal):
    text = '<?xml version="1.0"?>\n<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<robot name="&x;"/>'
    problem = refusal(text)
    assert (problem.line, problem.message) == (2, "DOCTYPE not allowed")


@pytest.mark.parametrize("text", [robot()[:400], b"\x7fELF\x02\x01\x01\x00\x00", b""])
def test_invalid_xml_is_reported_with_its_line(refusal, text):
    problem = refusal(text)
    assert "not well-formed XML" in problem.message
    assert problem.line >= 1


def test_three_thousand_links_are_too_many(refusal):
    problem = refusal(robot(extra="".join(f'<link name="l{k}"/>' for k in range(3000))))
    assert problem.message == "more than 200 links"


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        ('<box size="-1 1 1"/>', "size must be greater than 0"),
        ('<box size="1 1"/>', "size has 2 numbers instead of 3"),
        ('<sphere radius="nan"/>', "radius: must be from -1e+06 to 1e+06, got nan"),
        ('<cylinder radius="x" length="1"/>', "must consist of numbers"),
        ('<torus radius="1"/>', "unknown geometry <torus>"),
        ("", "<geometry> is empty"),
    ],
)
def test_impossible_shapes_are_refused_at_their_line(refusal, geometry, message):
    assert message in refusal(robot(geometry)).message


def test_negative_masses_are_refused(refusal):
    assert "negative" in refusal(robot(base=BASE.replace('value="4"', 'value="-4"'))).message


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('<link name="base"/>', "two <link>s are called 'base'"),
        ('<link name="loose"/>', "expected one root link, found 2"),
        ('<joint name="j" type="fixed"><parent link="base"/><child link="gone"/></joint>', "that does not exist"),
        ('<joint name="j" type="fixed"><parent link="left"/><child link="right"/></joint>', "child of two joints"),
        ('<link name="a"/><link name="b"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
         '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>', "loop of joints"),
        ('<joint name="j" type="fixed"><child link="left"/></joint>', "<joint> without <parent>"),
    ],
)  # fmt: skip
def test_invalid_link_trees_are_refused(refusal, extra, message):
    assert message in refusal(robot(extra=extra)).message


def test_several_mistakes_are_reported_at_once(load):
    invalid_link = '<link name="{}"><collision><geometry><box size="0 1 1"/></geometry></collision></link>'
    with pytest.raises(InvalidInput) as caught:
        load(robot(extra=invalid_link.format("a") + invalid_link.format("b")))
    assert len(caught.value.problems) == 2


def test_wheels_that_are_not_found_can_be_specified(load, refusal):
    text = robot().replace("cylinder", "box").replace('radius="0.05" length="0.03"', 'size="0.1 0.1 0.03"')
    problem = refusal(text)
    assert "no driven wheels" in problem.message and "left" in problem.hint
    body = load(text, drive={**DIFFERENTIAL, "left": ["left_joint"], "right": ["right_joint"]})
    assert [wheel.radius for wheel in body.wheels] == [0.05, 0.05]
    assert "no joint called 'leftt'" in refusal(text, drive={**DIFFERENTIAL, "left": ["leftt"]}).message


def test_a_hull_that_drags_over_the_ground_is_refused(refusal):
    problem = refusal(robot('<box size="0.5 0.36 0.4"/>'))
    assert problem.message == (
        "link 'base' reaches 50.0 mm below the lowest point of the wheels: it would drag over the ground"
    )
    assert problem.hint == "its <collision> must be at least 3 mm above this point"
    assert "link 'base' is 2.0 mm above the lowest point" in refusal(robot('<box size="0.5 0.36 0.296"/>')).message


def test_a_urdf_outside_the_root_is_refused(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "robot.urdf").write_text(robot())
    with pytest.raises(InvalidInput, match="outside the scenario root"):
        build_robot_body(spec(urdf="../robot.urdf"), tmp_path / "in/cart.robot.yaml", [tmp_path / "in"])


@pytest.mark.parametrize("specified", [(), ("left",), ("left", "right"), ("steering",), ("left", "right", "steering")])
@pytest.mark.parametrize("front", [{"left": 0.2, "right": -0.2}, {"middle": 0.0}])
def test_car_is_steered_by_the_wheels_below_vertical_joints(load, front, specified):
    steering = "".join(
        f"""
  <link name="knuckle_{side}"/>
  <joint name="steer_{side}" type="revolute"><parent link="base"/><child link="knuckle_{side}"/>
    <origin xyz="0.5 {y} 0"/><axis xyz="0 0 1"/><limit lower="-0.5" upper="0.5" effort="1" velocity="1"/></joint>
  {FRONT_WHEEL.format(side=side)}"""
        for side, y in front.items()
    )
    drive = {"type": "ackermann", "wheel_radius": 0.05, "wheel_separation": 0.4, "wheel_base": 0.4, "max_steering": 0.5}
    names = {"left": ["left_joint"], "right": ["right_joint"], "steering": [f"steer_{side}" for side in front]}
    body = load(robot(extra=steering), drive={**drive, **{key: names[key] for key in specified}})
    assert [(w.is_steered, w.is_driven, round(w.x, 3)) for w in body.wheels] == [
        (False, True, 0.0), (False, True, 0.0), *[(True, False, 0.4)] * len(front)]  # fmt: skip
    simulation = SingleRobotSimulation(body)
    simulation.drive(Twist(0.4, 0.0, 0.4))
    simulation.step(720)
    assert simulation.truth().twist == pytest.approx((0.4, 0.0, 0.4), abs=0.02)
    simulation.close()


@pytest.mark.parametrize("inertia", ["", '<inertia ixx="0.05" iyy="0.06" izz="0.08" ixy="1"/>'])
def test_robot_with_missing_or_impossible_inertia_drives_as_commanded(load, inertia):
    base = BASE.replace('<inertia ixx="0.05" iyy="0.06" izz="0.08"/>', inertia)
    simulation = SingleRobotSimulation(load(robot(base=base)))
    simulation.drive(Twist(0.4, 0.0, 0.4))
    simulation.step(720)
    assert simulation.truth().twist == pytest.approx((0.4, 0.0, 0.4), abs=0.02)
    simulation.close()


def test_xacro_files_are_expanded(tmp_path):
    (tmp_path / "robot.urdf.xacro").write_text(
        robot().replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" ')
    )
    assert build_robot_body(spec(urdf="robot.urdf.xacro"), tmp_path / "cart.robot.yaml", [tmp_path]).hull


@pytest.mark.parametrize("size", [25.0, 1e3, 1e30, 3e38])
def test_mesh_in_wrong_units_is_refused_at_its_line(refusal, tmp_path, size):
    corners = np.array([[0, 0, 0], [size, 0, 0], [0, size, 0], [0, 0, size]], dtype="<f4")
    faces = b"".join(
        bytes(12) + corners[list(face)].tobytes() + bytes(2) for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    (tmp_path / "big.stl").write_bytes(bytes(80) + struct.pack("<I", 4) + faces)
    problem = refusal(robot(geometry='<mesh filename="big.stl"/>'))
    assert (problem.path, problem.line) == ("robot.urdf", 5)
    assert f"mesh 'big.stl' reaches {size:.4g} m, more than 20 m" in problem.message
    assert "scale" in problem.hint


@pytest.mark.parametrize("geometry", ['<box size="25 0.36 0.2"/>', '<sphere radius="11"/>'])
def test_oversized_shapes_are_refused(refusal, geometry):
    problem = refusal(robot(geometry=geometry))
    assert problem.code in ("SC402", "SC400")
    assert "reaches" in problem.message


def test_oversized_body_without_urdf_is_refused(tmp_path):
    data = {"simscen": 1, "name": "cart", "drive": DIFFERENTIAL, "limits": LIMITS, "sensors": {}, "mass": 9}
    oversized = RobotSpec.model_validate({**data, "body": [{"box": [1000, 1, 1], "z": 0.1}]})
    with pytest.raises(InvalidInput, match=r"robot 'cart' reaches 500 m from its base, more than 10 m"):
        build_robot_body(oversized, tmp_path / "cart.robot.yaml")
