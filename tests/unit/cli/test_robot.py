"""`simscen robot check`: test drives, and consistency of the files of a robot."""

import json
import sys
from pathlib import Path

import pytest

from simscen.cli import main as cli

BOX = """
  <link name="base">
    <collision><origin xyz="{x} 0 {z}"/><geometry><box size="{size}"/></geometry></collision>
    <inertial><origin xyz="{x} 0 {z}"/><mass value="{mass}"/><inertia ixx="{i}" iyy="{i}" izz="{i}"/></inertial>
  </link>"""
WHEEL = """
  <link name="{name}">
    <collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="{r}" length="0.04"/></geometry></collision>
    <inertial><mass value="0.5"/></inertial>
  </link>
  <joint name="{name}_joint" type="continuous">
    <parent link="{parent}"/><child link="{name}"/><origin xyz="{x} {y} {z}"/><axis xyz="0 1 0"/>
  </joint>"""
KNUCKLE = """
  <link name="{name}"/>
  <joint name="{name}_joint" type="revolute">
    <parent link="base"/><child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.5" upper="0.5" effort="1" velocity="1"/>
  </joint>"""
CASTER = """
  <link name="caster"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="c" type="fixed"><parent link="base"/><child link="caster"/><origin xyz="-0.15 0 {z}"/></joint>"""


def wheels(parent="base", r=0.05, x=0.0, half=0.2, name="", z=None):
    """Return the URDF of a left and a right wheel with radius `r` on an axle of half length `half` at `x`, in m."""
    return "".join(
        WHEEL.format(name=f"{name}{side}", parent=parent.format(side=side), r=r, x=x, y=y, z=r if z is None else z)
        for side, y in (("left", half), ("right", -half))
    )


def urdf(*parts, size="0.4 0.3 0.1", mass=6, x=0.0, z=0.13, i=0.1):
    """Return the URDF of a robot with a box as its base; each principal moment of inertia is `i`."""
    return f'<robot name="cart">{BOX.format(size=size, mass=mass, x=x, z=z, i=i)}{"".join(parts)}\n</robot>\n'


def robot_yaml(drive):
    return (
        f"simscen: 1\nname: cart\nurdf: cart.urdf\ndrive:\n  {drive}\nsensors: {{}}\n"
        "limits: {linear: 1, angular: 1.5, linear_acceleration: 1, angular_acceleration: 2}\n"
    )


@pytest.fixture
def check(tmp_path, monkeypatch, capsys):
    """Return a function that writes files, checks a robot, and returns exit code, stdout, and stderr."""
    monkeypatch.chdir(tmp_path)

    def check(robot, *options, **files):
        for name, text in files.items():
            (tmp_path / name.replace("_", ".")).write_text(text)
        monkeypatch.setattr(sys, "argv", ["simscen", "robot", "check", robot, *options])
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, *capsys.readouterr()

    return check


@pytest.fixture
def check_as_json(check):
    """Return a function that writes files, checks a robot, and returns the JSON output."""

    def check_as_json(robot, **files):
        return json.loads(check(robot, "--json", **files)[1])

    return check_as_json


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", ["amr", "car", "jackal", "mecanum", "omni", "turtlebot"])
def test_every_shipped_robot_passes_the_check(check, name):
    code, output, _ = check(name)
    assert code == 0, output
    assert "checks passed" in output
    assert max(map(len, output.splitlines())) <= 80


def test_low_caster_is_reported_at_its_line(check):
    text = urdf(wheels(), CASTER.format(z=0.019))
    code, output, _ = check("cart.urdf", cart_urdf=text)
    assert code == 0
    line = text[: text.index('<link name="caster"')].count("\n") + 1
    assert f"cart.urdf:{line}:3: warning[SC405] link 'caster' reaches 1.0 mm below the wheels" in output
    assert "simscen uses frictionless spheres as casters instead" in output
    four_wheels = wheels(x=-0.15, name="rear_") + wheels(x=0.15, name="front_")
    assert (
        "simscen leaves it out of the hull"
        in check("cart.urdf", cart_urdf=urdf(four_wheels, CASTER.format(z=0.019)))[1]
    )


def test_caster_above_the_ground_is_reported(check):
    output = check("cart.urdf", cart_urdf=urdf(wheels(), CASTER.format(z=0.03)))[1]
    assert "link 'caster' is 10.0 mm above the ground" in output


def test_wheels_at_different_heights_are_reported(check):
    four_wheels = wheels(x=-0.15, name="rear_") + wheels(x=0.15, name="front_", z=0.052)
    output = check("cart.urdf", cart_urdf=urdf(four_wheels))[1]
    assert "the wheel on joint 'front_left_joint' is 2.0 mm higher than the lowest wheel" in output


def test_consistent_robot_has_no_warnings(check_as_json):
    assert check_as_json("cart.urdf", cart_urdf=urdf(wheels(), CASTER.format(z=0.02)))["problems"] == []


@pytest.mark.parametrize("with_spec", [False, True])
def test_reversed_car_is_rejected_at_its_line(check, with_spec):
    """Regression: it had a negative wheelbase."""
    knuckles = "".join(KNUCKLE.format(name=f"k_{side}", x=-0.3, y=y) for side, y in (("left", 0.2), ("right", -0.2)))
    front = "".join(
        WHEEL.format(name=f"front_{side}", parent=f"k_{side}", r=0.05, x=0, y=0, z=0.05) for side in ("left", "right")
    )
    drive = "{type: ackermann, wheel_radius: 0.05, wheel_separation: 0.4, wheel_base: 0.3, max_steering: 0.5}"
    spec = {"cart_robot_yaml": robot_yaml(drive)} if with_spec else {}
    name = "cart.robot.yaml" if with_spec else "cart.urdf"
    code, _, output = check(name, cart_urdf=urdf(wheels(), knuckles, front), **spec)
    assert code == 2
    assert "its steered wheels are 0.3 m behind the driven ones: only front steering is simulated" in output
    assert "cart.urdf:" in output.split(": error")[0]


DIFFERENTIAL = "{{type: differential, wheel_radius: {}, wheel_separation: {}}}"


def test_wrong_wheel_separation_is_reported_with_the_right_one(check):
    files = {"cart_urdf": urdf(wheels()), "cart_robot_yaml": robot_yaml(DIFFERENTIAL.format(0.05, 0.45))}
    code, output, _ = check("cart.robot.yaml", **files)
    assert code == 1
    assert "cart.robot.yaml:5:62: warning[SC404] wheel_separation is 0.45 m here, but 0.4 m in cart.urdf" in output
    assert float(output.split("wheel_separation 0.45 m: ")[1].split()[0]) == pytest.approx(0.4, rel=0.002)


def test_wrong_wheel_separation_is_a_warning_of_the_scenario(simscen):
    sensors = "{lidar: {lidar: {mount: {z: 0.3}}}, odom: {odometry: {}}}"
    text = robot_yaml(DIFFERENTIAL.format(0.05, 0.45)).replace("sensors: {}", f"sensors: {sensors}")
    Path("cart.robot.yaml").write_text(text)
    Path("cart.urdf").write_text(urdf(wheels()))
    scenario = Path("good.scenario.yaml").read_text()
    Path("good.scenario.yaml").write_text(scenario.replace("robot: {pose", "robot: {model: cart.robot.yaml, pose"))
    result = simscen("validate", "good.scenario.yaml")
    assert "cart.robot.yaml:5:62: warning[SC404] wheel_separation is 0.45 m here, but 0.4 m in cart.urdf" in result.out
    assert result.code == 0


@pytest.mark.parametrize(
    ("old", "new", "code", "expected_text"),
    [
        ("x", "x", 0, "1 robot is valid"),
        ("radius: 0.05", "radius: 0.06", 0, "warning[SC404] wheel_radius is 0.06 m here, but 0.05 m in cart.urdf"),
        ("limits:", "arguments: {a: 1}\nlimits:", 2, "cart.robot.yaml:7:13: error[SC403] `cart.urdf` declares no"),
        ("0.05, wheel", "0.05, left: [x], right: [y], wheel", 2, "cart.urdf:1:1: error[SC400] no joint called 'x'"),
    ],
)
def test_validate_builds_urdf_robots(simscen, old, new, code, expected_text):
    """Regression: robots that no scenario can use were valid."""
    Path("cart.robot.yaml").write_text(robot_yaml(DIFFERENTIAL.format(0.05, 0.4)).replace(old, new))
    Path("cart.urdf").write_text(urdf(wheels()))
    result = simscen("validate", "cart.robot.yaml")
    assert expected_text in result.out
    assert result.code == code
    assert simscen("validate", "--fast", "cart.robot.yaml").code == 0


def test_validate_reports_a_dragging_body(simscen):
    text = robot_yaml(DIFFERENTIAL.format(0.05, 0.4)).replace(
        "urdf: cart.urdf", "mass: 5\nbody: [{box: [0.3, 0.3, 0.2]}]"
    )
    Path("cart.robot.yaml").write_text(text)
    result = simscen("validate", "cart.robot.yaml")
    assert "error[SC401] a part of the body of 'cart' reaches the ground" in result.out
    assert result.code == 2


def test_wrong_wheel_radius_is_reported_with_the_right_one(check):
    files = {"cart_urdf": urdf(wheels()), "cart_robot_yaml": robot_yaml(DIFFERENTIAL.format(0.06, 0.4))}
    code, output, _ = check("cart.robot.yaml", **files)
    assert code == 1
    assert "wheel_radius is 0.06 m here, but 0.05 m in cart.urdf" in output
    assert float(output.split("wheel_radius 0.06 m: ")[1].split()[0]) == pytest.approx(0.05, rel=0.002)
    assert "wheel_separation 0.4 m:" not in output


SKID = "{{type: skid_steer, wheel_radius: 0.16, wheel_separation: 0.56, wheel_base: 0.5, turning_scale: {}}}"


@pytest.mark.slow
def test_suggested_turning_scale_passes_the_check(check_as_json):
    """Skidding wheels turn a heavy base as with a larger wheel separation."""
    four_wheels = wheels(x=-0.25, r=0.16, half=0.28, name="rear_") + wheels(x=0.25, r=0.16, half=0.28, name="front_")
    files = {"cart_urdf": urdf(four_wheels, size="0.9 0.4 0.2", mass=45, z=0.25, i=1.5)}
    name = "turn: odometry against true angle"

    def measured_turn(scale):
        output = check_as_json("cart.robot.yaml", **files, cart_robot_yaml=robot_yaml(SKID.format(scale)))
        return next(check for check in output["checks"] if check["name"] == name)

    wrong = measured_turn(1.44)
    assert not wrong["held"]
    assert wrong["advice"].startswith("turning_scale 1.44: ")
    right = measured_turn(wrong["advice"].split(": ")[1].split()[0])
    assert right["value"] < 0.5


@pytest.mark.sample(2)
@pytest.mark.parametrize("axles", [(-0.15, 0.15), (-0.25, 0.25), (-0.3, 0.3), (-0.25, 0, 0.25), (-0.3, -0.1, 0.1, 0.3)])
def test_inferred_skid_steer_robot_turns_as_commanded(check_as_json, axles):
    """Regression: robots with four wheels turned up to 31 % too little, and those with six up to twice as far."""
    parts = [wheels(x=x, r=0.1, half=0.25, name=f"axle_{index}_") for index, x in enumerate(axles)]
    output = check_as_json("cart.urdf", cart_urdf=urdf(*parts, size="0.6 0.4 0.2", mass=20, z=0.2, i=0.8))
    turn = next(check for check in output["checks"] if check["name"] == "turn: true angle against command")
    assert turn["value"] < 5


def test_drifting_skid_steered_base_is_reported(check):
    four_wheels = wheels(x=-0.25, r=0.16, half=0.28, name="rear_") + wheels(x=0.25, r=0.16, half=0.28, name="front_")
    code, output, _ = check(
        "cart.urdf", cart_urdf=urdf(four_wheels, size="0.7 0.4 0.2", mass=45, z=0.25, i=1.5, x=-0.1)
    )
    assert code == 1
    assert "FAILED  turn: distance from the start" in output
    assert "behind the center of its wheels" in output


MECANUM = "{{type: mecanum, wheel_radius: 0.05, wheel_separation: {}, wheel_base: 0.4}}"


def test_urdf_with_mecanum_wheels_drives_sideways(check_as_json):
    four_wheels = wheels(x=-0.2, name="rear_") + wheels(x=0.2, name="front_")
    output = check_as_json(
        "cart.robot.yaml", cart_urdf=urdf(four_wheels), cart_robot_yaml=robot_yaml(MECANUM.format(0.4))
    )
    assert output["passed"] and not output["problems"]
    (sideways,) = (trial for trial in output["trials"] if trial["name"] == "sideways")
    assert sideways["truth"]["end"]["y"] == pytest.approx(2.0, abs=0.01)


def test_misplaced_mecanum_wheels_are_reported(check):
    four_wheels = wheels(x=-0.2, name="rear_") + wheels(x=0.2, name="front_")
    code, output, _ = check(
        "cart.robot.yaml", cart_urdf=urdf(four_wheels), cart_robot_yaml=robot_yaml(MECANUM.format(0.5))
    )
    assert code == 1
    assert "wheel_separation is 0.5 m here, but 0.4 m in cart.urdf" in output
    assert "cot(roller_angle) 0.45 m: 0.4 m fits" in output


def test_two_mecanum_wheels_are_rejected(check):
    files = {"cart_urdf": urdf(wheels()), "cart_robot_yaml": robot_yaml(MECANUM.format(0.4))}
    code, _, output = check("cart.robot.yaml", **files)
    assert code == 2
    assert "a mecanum drive has one wheel at each of four corners; found: left_joint, right_joint" in output


def test_robot_check_is_reproducible(check, tmp_path):
    first, second = (check("turtlebot", "--json", "--picture", f"{name}.png")[1] for name in ("a", "b"))
    assert first == second
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("robot", ["turtlebotx", "gone.urdf"])
def test_missing_robot_is_an_error(check, robot):
    code, _, output = check(robot)
    assert code == 2
    assert f"{robot}: error[SC001] no such file or shipped robot: `{robot}`" in output
