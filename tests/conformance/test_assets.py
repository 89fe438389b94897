"""Conformance tests of referenced files: paths outside the root, and invalid URDFs and meshes."""

import os
import struct
from pathlib import Path

import pytest

MAP = "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"

URDF_ROBOT = """\
simscen: 1
name: cube
urdf: cube.urdf
drive: {type: omnidirectional}
limits: {linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}
sensors: {lidar: {lidar: {rate: 10 Hz}}, odom: {odometry: {}}}
"""

URDF = """\
<?xml version="1.0"?>
<robot name="cube">
  <link name="base">
    <collision>
      <geometry><box size="0.3 0.2 0.3"/></geometry>
    </collision>
    <inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
  </link>
</robot>
"""

BOX = '<box size="0.3 0.2 0.3"/>'


@pytest.fixture
def with_urdf(folder: Path, with_scenario):
    """Return `refused` for a scenario with a robot that has the given URDF."""

    def call(urdf: str | bytes) -> str:
        (folder / "cube.urdf").write_bytes(urdf.encode() if isinstance(urdf, str) else urdf)
        (folder / "cube.robot.yaml").write_text(URDF_ROBOT)
        return with_scenario(replace={})

    return call


def test_base_urdf_is_valid(simscen, folder: Path) -> None:
    (folder / "cube.urdf").write_text(URDF)
    (folder / "cube.robot.yaml").write_text(URDF_ROBOT)
    assert simscen("validate", "a.scenario.yaml").out == "1 scenario is valid\n"


@pytest.mark.parametrize(
    ("written", "message"),
    [
        pytest.param("../../etc/passwd", "outside the scenario root", id="31 to etc"),
        pytest.param("../secret.world.yaml", "outside the scenario root", id="31 to an existing file"),
        pytest.param("../nothing.world.yaml", "outside the scenario root", id="31 to a missing file"),
        pytest.param("/etc/passwd", "is an absolute path", id="32"),
        pytest.param("~/x.yaml", "is an absolute path", id="32 home"),
        pytest.param("file:///etc/passwd", "is a URL", id="32 URL"),
        pytest.param("away.yaml", "outside the scenario root", id="33"),
        pytest.param("away/secret.world.yaml", "outside the scenario root", id="33 by a folder"),
        pytest.param("loop.yaml", "symbolic link loop", id="34"),
        pytest.param(r'"a\0b.yaml"', "control character", id="36 NUL"),
        pytest.param("x" * 4000, "the name is too long", id="36 long name"),
        pytest.param("x" * 5000, "longer than 4096 characters", id="36 longer name"),
        pytest.param("no.world.yaml", "no such file or directory", id="missing"),
        pytest.param(".", "not a regular file", id="a folder"),
    ],
)
@pytest.mark.parametrize("referrer", ["world", "robot"])
def test_unusable_path_is_an_error(with_scenario, folder: Path, referrer: str, written: str, message: str) -> None:
    (folder / "../secret.world.yaml").write_text("password: 1234\n")
    (folder / "away.yaml").symlink_to("../secret.world.yaml")
    (folder / "away").symlink_to("..")
    (folder / "loop.yaml").symlink_to("loop.yaml")
    if "/" not in written and ".yaml" not in written and referrer == "robot":
        written = f"./{written}"
    old, place = {"world": ("room.world.yaml", "3:8"), "robot": ("cube.robot.yaml", "4:16")}[referrer]
    problems = with_scenario(replace={old: written})
    assert problems.startswith(f"bad.scenario.yaml:{place}: error[SC0")
    assert message in problems.splitlines()[0]
    assert "1234" not in problems
    assert "root:" not in problems


@pytest.mark.parametrize("key", ["extends", "map", "image", "sdf", "urdf"])
def test_31_other_paths_outside_the_root_are_errors(with_scenario, folder: Path, key: str) -> None:
    (folder / "../secret.yaml").write_text("password: 1234\n")
    files = {
        "extends": ("a.scenario.yaml", None),
        "map": ("room.world.yaml", "simscen: 1\nmap: ../secret.yaml\n"),
        "sdf": ("room.world.yaml", "simscen: 1\nsdf: ../secret.yaml\n"),
        "image": ("room.world.yaml", MAP.replace("map.pgm", "../secret.yaml")),
        "urdf": ("cube.robot.yaml", URDF_ROBOT.replace("cube.urdf", "../secret.yaml")),
    }
    name, text = files[key]
    if text is not None:
        (folder / name).write_text(text)
    problems = with_scenario("extends: ../secret.yaml\n" if key == "extends" else None)
    assert "`../secret.yaml` is outside the scenario root" in problems
    assert "1234" not in problems


def test_33_scenario_and_defaults_cannot_be_links_outside_the_root(with_scenario, refused, folder: Path) -> None:
    (folder / "../secret.yaml").write_text("password: 1234\n")
    (folder / "link.scenario.yaml").symlink_to("../secret.yaml")
    message = refused("link.scenario.yaml")
    assert "link.scenario.yaml: error[SC020] the file is outside the scenario root" in message
    (folder / "defaults.yaml").symlink_to("../secret.yaml")
    message += with_scenario(replace={})
    assert "defaults.yaml: error[SC020] the file is outside the scenario root" in message
    assert "1234" not in message


def test_35_circular_extends_is_an_error(refused, folder: Path) -> None:
    for name, base in (("one", "two"), ("two", "three"), ("three", "one")):
        (folder / f"{name}.scenario.yaml").write_text(f"simscen: 1\nextends: {base}.scenario.yaml\n")
    chain = "one.scenario.yaml → two.scenario.yaml → three.scenario.yaml → one.scenario.yaml"
    assert f"three.scenario.yaml:2:10: error[SC024] circular `extends`: {chain}" in refused("one.scenario.yaml")


@pytest.mark.parametrize("name", ["x" * 300 + ".scenario.yaml", "x" * 5000])
def test_36_too_long_argument_is_an_error(refused, name: str) -> None:
    assert "the name is too long" in refused(name)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        pytest.param("gone.stl", "no such file or directory", id="37"),
        pytest.param("../secret.stl", "outside the scenario root", id="38 up"),
        pytest.param("/etc/passwd", "absolute paths are not read", id="38 absolute"),
        pytest.param("package://robot/base.stl", "there is no package 'robot'", id="38 package"),
        pytest.param("folder.stl", "not a regular file", id="39 mesh"),
        pytest.param("fifo.stl", "not a regular file", id="40"),
        pytest.param("lying.stl", "STL header says 4000000000 triangles, file holds 1", id="41"),
        pytest.param("nan.stl", "a vertex is not a finite number", id="41 not finite"),
        pytest.param("huge.stl", "larger than 20 MiB", id="41 large"),
        pytest.param("empty.stl", "too short for an STL file", id="41 empty"),
        pytest.param("text.obj", "not a readable OBJ file", id="41 not a mesh"),
    ],
)
def test_unusable_mesh_of_a_urdf_is_an_error(with_urdf, folder: Path, mesh: str, message: str) -> None:
    triangle = struct.pack("<12fH", *[0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0], 0)
    (folder / "lying.stl").write_bytes(bytes(80) + struct.pack("<I", 4_000_000_000) + triangle)
    (folder / "nan.stl").write_bytes(bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[float("nan")] * 12, 0))
    (folder / "empty.stl").write_bytes(b"")
    (folder / "text.obj").write_text("v 0 0 0\nf 1 x 3\n")
    (folder / "folder.stl").mkdir()
    os.mkfifo(folder / "fifo.stl")
    with (folder / "huge.stl").open("wb") as file:
        file.truncate(21 << 20)
    head = with_urdf(URDF.replace(BOX, f'<mesh filename="{mesh}"/>')).splitlines()[0]
    assert head.startswith("cube.urdf:5:17: error[SC400]")
    assert mesh in head
    assert message in head


def test_39_urdf_must_be_a_regular_file(with_scenario, folder: Path) -> None:
    (folder / "cube.urdf").mkdir()
    (folder / "cube.robot.yaml").write_text(URDF_ROBOT)
    assert "cube.robot.yaml:3:7: error[SC001] not a regular file: `cube.urdf`" in with_scenario(replace={})


def test_dragging_robot_in_another_folder_is_reported_with_a_valid_path(with_scenario, folder: Path) -> None:
    (folder / "robots").mkdir()
    text = (folder / "cube.robot.yaml").read_text()
    (folder / "robots/cube.robot.yaml").write_text(text.replace("z: 4 cm", "z: 0"))
    message = with_scenario(replace={"cube.robot.yaml": "robots/cube.robot.yaml"})
    assert message.startswith("robots/cube.robot.yaml: error[SC401] a part of the body of 'cube' reaches the ground")


def linked(count: int) -> str:
    joint = '<joint name="j{0}" type="fixed"><parent link="base"/><child link="l{0}"/></joint><link name="l{0}"/>'
    return URDF.replace("</robot>", "\n".join(joint.format(i) for i in range(count)) + "</robot>")


@pytest.mark.parametrize(
    ("urdf", "place", "message"),
    [
        pytest.param(
            URDF.replace("<robot", '<!DOCTYPE r [<!ENTITY e SYSTEM "/etc/passwd">]>\n<robot', 1), "2:1",
            "DOCTYPE not allowed", id="42",
        ),
        pytest.param(URDF[:150], "7:2", "not well-formed XML", id="43 truncated"),
        pytest.param(bytes(range(256)), "1:1", "not well-formed XML", id="43 binary"),
        pytest.param("", "1:1", "not well-formed XML: no element found", id="43 empty"),
        pytest.param(linked(3000), "2:1", "more than 200 links", id="44"),
        pytest.param(URDF.replace("0.3 0.2 0.3", "0.3 -0.2 0.3"), "5:17", "size must be greater than 0", id="50 size"),
        pytest.param(URDF.replace('mass value="5"', 'mass value="-5"'), "7:15", "a mass must not be", id="50 mass"),
        pytest.param(URDF.replace('mass value="5"', 'mass value="nan"'), "7:15", "must be from -1e+06", id="50 nan"),
    ],
)  # fmt: skip
def test_unusable_urdf_is_an_error(with_urdf, urdf: str, place: str, message: str) -> None:
    head = with_urdf(urdf).splitlines()[0]
    assert head.startswith(f"cube.urdf:{place}")
    assert message in head
    assert "root:" not in head


def test_problem_has_the_shortest_valid_path(refused, folder: Path, monkeypatch) -> None:
    (folder / "bad.scenario.yaml").write_text("- a list\n")
    deep = folder.parent / "/".join("a deep folder" for _ in range(60))
    deep.mkdir(parents=True)
    monkeypatch.chdir(deep)
    assert refused(folder / "bad.scenario.yaml").startswith(f"{folder}/bad.scenario.yaml:1:1: error[SC004]")
    monkeypatch.chdir(folder.parent)
    assert refused(folder / "bad.scenario.yaml").startswith("home/bad.scenario.yaml:1:1: error[SC004]")


def test_problem_in_a_world_path_folder_has_a_valid_path(folder: Path, refused) -> None:
    away = folder.parent / "away"
    away.mkdir()
    (away / "bad.sdf").write_text('<sdf version="1.7"><world name="room">')
    (away / "bad.robot.yaml").write_text(URDF_ROBOT)
    (away / "cube.urdf").write_text("<robot")
    text = (folder / "a.scenario.yaml").read_text()
    for old, new, file in (
        ("room.world.yaml", "bad.sdf", "bad.sdf"),
        ("cube.robot.yaml", "bad.robot.yaml", "cube.urdf"),
    ):
        (folder / "bad.scenario.yaml").write_text(text.replace(old, new))
        message = refused("bad.scenario.yaml", "--world-path", away)
        assert message.startswith(f"../away/{file}:")
