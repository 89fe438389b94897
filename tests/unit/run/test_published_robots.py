"""Tests of robots that are published as ROS packages: packages, arguments, and includes of xacro files."""

import pytest
from pydantic import ValidationError

from simscen.core.errors import InvalidInput
from simscen.loading.builders import robot_from_file
from simscen.loading.files.single_files import load_robot_file
from simscen.model.robot import RobotSpec

ROBOT = """\
simscen: 1
name: cart
urdf: {urdf}
{more}
drive: {{type: differential, wheel_radius: 0.05, wheel_separation: 0.4}}
limits: {{linear: 1, angular: 1, linear_acceleration: 1, angular_acceleration: 1}}
sensors: {{}}
"""
XACRO = """\
<robot name="cart" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="plate" default="false"/>
  <xacro:arg name="length" default="0.5"/>
  <xacro:include filename="$(find cart_parts)/urdf/wheel.xacro"/>
  <link name="base">
    <collision><origin xyz="0 0 0.2"/><geometry><box size="$(arg length) 0.3 0.2"/></geometry></collision>
    <inertial><mass value="9"/></inertial>
  </link>
  <xacro:wheel side="left" y="0.2"/>
  <xacro:wheel side="right" y="-0.2"/>
  <xacro:if value="$(arg plate)">
    <xacro:arg name="thick" default="0.01"/>
    <link name="plate">
      <collision><geometry><mesh filename="{mesh}"/></geometry></collision>
    </link>
    <joint name="p" type="fixed"><parent link="base"/><child link="plate"/><origin xyz="0 0 0.4"/></joint>
  </xacro:if>
</robot>
"""
WHEEL = """\
<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="side y">
    <link name="${side}">
      <collision><origin rpy="${pi/2} 0 0"/><geometry><cylinder radius="0.05" length="0.03"/></geometry></collision>
      <inertial><mass value="0.3"/></inertial>
    </link>
    <joint name="${side}_joint" type="continuous">
      <parent link="base"/><child link="${side}"/><origin xyz="0 ${y} 0.05"/><axis xyz="0 1 0"/>
    </joint>
  </xacro:macro>
</robot>
"""
TETRAHEDRON = """\
v 0 0 0
v 0.3 0 0
v 0 0.3 0
v 0 0 0.3
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


@pytest.fixture
def published(tmp_path):
    """Return a function that loads the body of a robot from two packages in different repositories.

    `more` are further lines of its *.robot.yaml, `parts` is the folder of the second package, and `edit` changes
    the text of the xacro file.
    """

    def body(more="", mesh="package://cart_parts/meshes/plate.obj", parts="repo/cart_parts", world_path=(), edit=str):
        files = {
            "cart.robot.yaml": ROBOT.format(urdf="repo/cart_description/urdf/cart.urdf.xacro", more=more),
            "repo/cart_description/urdf/cart.urdf.xacro": edit(XACRO.replace("{mesh}", mesh)),
            f"{parts}/urdf/wheel.xacro": WHEEL,
            f"{parts}/meshes/plate.obj": TETRAHEDRON,
        }
        for name, text in files.items():
            (tmp_path / "root" / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / "root" / name).write_text(text)
        root = tmp_path / "root"
        file = load_robot_file(str(root / "cart.robot.yaml"), root, [root / folder for folder in world_path])
        return robot_from_file(file.robot, file.roots)[1]

    return body


@pytest.fixture
def refusal(published):
    """Return a function that returns the first problem of a robot that cannot be loaded."""

    def load(*args, **more):
        with pytest.raises(InvalidInput) as caught:
            published(*args, **more)
        return caught.value.problems[0]

    return load


def test_a_package_beside_the_package_of_the_robot_is_found(published):
    assert [wheel.y for wheel in published().wheels] == [0.2, -0.2]


def test_a_package_in_another_repository_of_the_workspace_is_found(published):
    assert published(parts="other_repo/cart_parts").wheels


def test_a_package_in_a_subfolder_of_its_repository_is_found(published):
    assert published(parts="other_repo/common/cart_parts").wheels


def test_a_package_is_found_through_a_folder_of_the_world_path(published):
    assert published(parts="../ros/share/cart_parts", world_path=["../ros/share"]).wheels


def test_a_package_path_in_the_robot_file_is_used(published):
    assert published("packages: {cart_parts: vendor/parts}", parts="vendor/parts").wheels


def test_missing_package_is_reported_at_its_line(refusal):
    problem = refusal(parts="vendor/parts")
    assert (problem.path, problem.line) == ("repo/cart_description/urdf/cart.urdf.xacro", 4)
    assert problem.message == "$(find cart_parts): there is no package 'cart_parts'"
    assert "--world-path" in problem.hint and "packages: {cart_parts: path}" in problem.hint


def test_all_missing_packages_are_reported_at_once(published):
    def add_includes(text):
        find = '<xacro:include filename="$(find {})/x.xacro"/>'
        return text.replace("<link", find.format("sensors") + find.format("cart_parts") + "<link", 1)

    with pytest.raises(InvalidInput) as caught:
        published(parts="vendor/parts", edit=add_includes)
    assert [problem.message for problem in caught.value.problems] == [
        "$(find cart_parts): there is no package 'cart_parts'",
        "$(find sensors): there is no package 'sensors'",
    ]


def test_a_package_outside_the_root_is_refused_at_its_line(refusal):
    problem = refusal("packages: {cart_parts: ../ros/share/cart_parts}", parts="../ros/share/cart_parts")
    assert (problem.path, problem.line, problem.code) == ("cart.robot.yaml", 4, "SC020")


def test_a_package_that_is_a_file_or_missing_is_refused_at_its_line(refusal):
    assert refusal("packages: {cart_parts: cart.robot.yaml}").message == "not a folder: `cart.robot.yaml`"
    assert refusal("packages: {cart_parts: gone}").line == 4


@pytest.mark.parametrize(
    "mesh",
    [
        "package://cart_parts/meshes/plate.obj",
        "$(find cart_parts)/meshes/plate.obj",
        "file://$(find cart_parts)/meshes/plate.obj",
        "../../cart_parts/meshes/plate.obj",
    ],
)
def test_a_mesh_is_found_by_every_notation_of_xacro_files(published, mesh):
    assert "plate" in [solid.name for solid in published("arguments: {plate: true}", mesh).hull]


@pytest.mark.parametrize("mesh", ["package://cart_parts/../../../x.obj", "file:///etc/passwd", "/etc/passwd"])
def test_a_mesh_outside_the_root_is_not_read(refusal, mesh):
    assert "outside the scenario root" in refusal("arguments: {plate: true}", mesh).message


@pytest.mark.parametrize(("written", "length"), [("0.6", 0.6), ("'0.7'", 0.7), ("1", 1.0)])
def test_an_argument_replaces_its_default(published, written, length):
    (base,) = (solid for solid in published(f"arguments: {{length: {written}}}").hull if solid.name == "base")
    assert base.shape.size[0] == length


def test_undeclared_argument_is_reported_with_a_suggestion(refusal):
    problem = refusal("arguments:\n  plate: true\n  lenght: 0.6")
    assert (problem.path, problem.line, problem.col, problem.code) == ("cart.robot.yaml", 6, 3, "SC403")
    assert problem.message == "`cart.urdf.xacro` declares no argument `lenght`"
    assert problem.hint == "did you mean `length`?"


def test_an_argument_may_be_declared_in_a_block_that_is_not_expanded(published):
    assert published("arguments: {thick: 0.02}").wheels


def test_arguments_without_a_urdf_are_refused():
    spec = {"simscen": 1, "name": "x", "mass": 1.0, "body": [{"box": [0.1, 0.1, 0.1], "z": 0.1}], "sensors": {}}
    limits = {"linear": 1, "angular": 1, "linear_acceleration": 1, "angular_acceleration": 1}
    with pytest.raises(ValidationError, match="`packages` and `arguments` are only valid with `urdf`"):
        RobotSpec.model_validate(
            {**spec, "drive": {"type": "omnidirectional"}, "limits": limits, "arguments": {"a": 1}}
        )
