"""Conformance tests of referenced files: paths outside the root, and invalid worlds, maps, meshes, and robots."""

import os
import struct
import zlib
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
SDF = """\
<?xml version="1.0"?>
<sdf version="1.7">
  <world name="room">
    <model name="thing"><static>true</static><link name="link"><collision name="c"><geometry>
      {geometry}
    </geometry></collision></link></model>
  </world>
</sdf>
"""


@pytest.fixture
def with_world(folder: Path, with_scenario):
    """`refused` for a scenario whose world is the file `name` with `content`; the robot stands at (1, 1)."""

    def call(content: str | bytes, name: str = "bad.world.yaml") -> str:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return with_scenario(replace={"room.world.yaml": name})

    return call


@pytest.fixture
def with_map(folder: Path, with_world):
    """`refused` for a scenario whose world is a ROS map with such an image."""

    def call(image: bytes, name: str = "map.pgm", lines: str = "") -> str:
        (folder / name).write_bytes(image)
        return with_world(MAP.replace("map.pgm", name) + lines, "map.yaml")

    return call


@pytest.fixture
def with_urdf(folder: Path, with_scenario):
    """`refused` for a scenario whose robot has such a URDF."""

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
    ("written", "told"),
    [
        pytest.param("../../etc/passwd", "outside the scenario root", id="31 to etc"),
        pytest.param("../secret.world.yaml", "outside the scenario root", id="31 to a file that is there"),
        pytest.param("../nothing.world.yaml", "outside the scenario root", id="31 to a file that is not there"),
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
@pytest.mark.parametrize("named", ["world", "robot"])
def test_unusable_path_is_an_error(with_scenario, folder: Path, named: str, written: str, told: str) -> None:
    (folder / "../secret.world.yaml").write_text("password: 1234\n")
    (folder / "away.yaml").symlink_to("../secret.world.yaml")
    (folder / "away").symlink_to("..")
    (folder / "loop.yaml").symlink_to("loop.yaml")
    if "/" not in written and ".yaml" not in written and named == "robot":
        written = f"./{written}"
    old, place = {"world": ("room.world.yaml", "3:8"), "robot": ("cube.robot.yaml", "4:16")}[named]
    problems = with_scenario(replace={old: written})
    assert problems.startswith(f"bad.scenario.yaml:{place}: error[SC0")
    assert told in problems.splitlines()[0]
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
    told = refused("link.scenario.yaml")
    assert "link.scenario.yaml: error[SC020] the file is outside the scenario root" in told
    (folder / "defaults.yaml").symlink_to("../secret.yaml")
    told += with_scenario(replace={})
    assert "defaults.yaml: error[SC020] the file is outside the scenario root" in told
    assert "1234" not in told


def test_35_files_that_extend_each_other(refused, folder: Path) -> None:
    for name, base in (("one", "two"), ("two", "three"), ("three", "one")):
        (folder / f"{name}.scenario.yaml").write_text(f"simscen: 1\nextends: {base}.scenario.yaml\n")
    chain = "one.scenario.yaml → two.scenario.yaml → three.scenario.yaml → one.scenario.yaml"
    assert f"three.scenario.yaml:2:10: error[SC024] circular `extends`: {chain}" in refused("one.scenario.yaml")


@pytest.mark.parametrize("name", ["x" * 300 + ".scenario.yaml", "x" * 5000])
def test_36_an_argument_longer_than_names_can_be(refused, name: str) -> None:
    assert "the name is too long" in refused(name)


@pytest.mark.parametrize(
    ("mesh", "told"),
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
def test_unusable_mesh_of_a_urdf_is_an_error(with_urdf, folder: Path, mesh: str, told: str) -> None:
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
    assert told in head


def test_39_a_urdf_that_is_a_folder(with_scenario, folder: Path) -> None:
    (folder / "cube.urdf").mkdir()
    (folder / "cube.robot.yaml").write_text(URDF_ROBOT)
    assert "cube.robot.yaml:3:7: error[SC001] not a regular file: `cube.urdf`" in with_scenario(replace={})


def test_dragging_robot_in_another_folder_is_reported_with_a_valid_path(with_scenario, folder: Path) -> None:
    (folder / "robots").mkdir()
    text = (folder / "cube.robot.yaml").read_text()
    (folder / "robots/cube.robot.yaml").write_text(text.replace("z: 4 cm", "z: 0"))
    told = with_scenario(replace={"cube.robot.yaml": "robots/cube.robot.yaml"})
    assert told.startswith("robots/cube.robot.yaml: error[SC401] a part of the body of 'cube' reaches the ground")


def linked(count: int) -> str:
    joint = '<joint name="j{0}" type="fixed"><parent link="base"/><child link="l{0}"/></joint><link name="l{0}"/>'
    return URDF.replace("</robot>", "\n".join(joint.format(i) for i in range(count)) + "</robot>")


@pytest.mark.parametrize(
    ("urdf", "place", "told"),
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
        pytest.param(URDF.replace('mass value="5"', 'mass value="nan"'), "7:15", "finite number", id="50 nan"),
    ],
)  # fmt: skip
def test_unusable_urdf_is_an_error(with_urdf, urdf: str, place: str, told: str) -> None:
    head = with_urdf(urdf).splitlines()[0]
    assert head.startswith(f"cube.urdf:{place}")
    assert told in head
    assert "root:" not in head


def png(width: int, height: int, data: bytes) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


BOMB = png(13000, 13000, zlib.compress(bytes(13001) * 1000, 9))


@pytest.mark.parametrize(
    ("name", "image", "told"),
    [
        pytest.param("map.pgm", b"P5 100000 100000 255\n" + bytes(100), "map too large: 100000 x 100000", id="45"),
        pytest.param("map.pgm", b"P5 4 4 255\n" + bytes(15), "the PGM is truncated: 15 of 16", id="46 short"),
        pytest.param("map.pgm", b"P5 4 4 0\n" + bytes(16), "maxval must be between 1 and 65535", id="46 maxval"),
        pytest.param("map.pgm", b"P5 0 4 255\n", "the image has no pixels", id="46 no width"),
        pytest.param("map.pgm", b"P5 -4 4 255\n", "the PGM header is damaged", id="46 negative"),
        pytest.param("map.pgm", b"P5 4", "the PGM header is damaged", id="46 short header"),
        pytest.param("map.pgm", b"P2 4 4 255\n1 2 3\n", "the PGM is truncated: 3 of 16 pixels", id="46 P2 short"),
        pytest.param("map.pgm", b"P2 2 1 255\n1 256\n", "a pixel is 256, above the maxval", id="46 P2 above"),
        pytest.param("map.pgm", b"P2 2 1 255\n1 -1\n", "not a number", id="46 P2 below"),
        pytest.param("map.pgm", b"P2 1 1 255\n" + b"9" * 5000 + b"\n", "", id="46 P2 long number"),
        pytest.param("map.pgm", b"", "not a PGM (P2, P5), PNG or BMP image", id="46 empty"),
        pytest.param("map.png", BOMB, "map too large: 13000 x 13000 pixels", id="47"),
        pytest.param("map.png", png(4, 4, b"nonsense"), "the PNG cannot be decoded", id="47 damaged"),
        pytest.param("map.png", png(4, 4, b"")[:30], "the PNG cannot be decoded", id="47 truncated"),
        pytest.param("map.bmp", b"BM" + bytes(12) + struct.pack("<Iii", 40, 99999, 99999), "too large", id="47 BMP"),
    ],
)  # fmt: skip
def test_invalid_map_image_is_an_error(with_map, name: str, image: bytes, told: str) -> None:
    head = with_map(image, name).splitlines()[0]
    assert head.startswith(f"{name}: error[SC320]")
    assert told in head


@pytest.mark.parametrize(
    ("name", "image"), [("map.pgm", b"P5 100000 100000 255\n"), ("map.png", BOMB)], ids=["45 PGM", "47 PNG"]
)
def test_too_large_map_is_an_error_without_using_memory(cost, is_cheap, folder: Path, name: str, image: bytes) -> None:
    (folder / name).write_bytes(image)
    (folder / "room.world.yaml").write_text(MAP.replace("map.pgm", name))
    code, peak, cpu, told = cost("validate", "a.scenario.yaml")
    assert (code, "too large" in told) == (2, True)
    assert peak < 150
    assert is_cheap(cpu)


@pytest.mark.parametrize("kind", ["fifo", "folder", "device"])
def test_26_an_image_that_is_not_a_regular_file(with_world, folder: Path, kind: str) -> None:
    if kind == "fifo":
        os.mkfifo(folder / "map.pgm")
    elif kind == "folder":
        (folder / "map.pgm").mkdir()
    else:
        (folder / "map.pgm").symlink_to("/dev/zero")
    assert with_world(MAP, "map.yaml").startswith("map.yaml:1:8: error[SC0")


@pytest.mark.parametrize(
    ("lines", "place", "told"),
    [
        ("occupied_thresh: 0.2\nfree_thresh: 0.6\n", "5:14", "must be less than occupied_thresh"),
        ("occupied_thresh: 0.2\n", "1:1", "must be less than occupied_thresh"),
        ("mode: fancy\n", "4:7", "`fancy` is not one of the choices"),
        ("negate: 2\n", "4:9", ""),
    ],
)
def test_invalid_map_yaml_is_an_error(with_map, lines: str, place: str, told: str) -> None:
    head = with_map(b"P5 4 4 255\n" + bytes(16), lines=lines).splitlines()[0]
    assert head.startswith(f"map.yaml:{place}: error[SC0")
    assert told in head


def test_map_with_huge_resolution_is_an_error(with_world, folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"P5 40 40 255\n" + b"\xff" * 1600)
    told = with_world(MAP.replace("0.05", "1000"), "map.yaml")
    assert told.startswith("map.pgm: error[SC320] map too large: 40 x 40 pixels of 1000 m extend to 40000 m")


@pytest.mark.parametrize(
    ("geometry", "told"),
    [
        pytest.param("<heightmap><uri>terrain.png</uri><size>9 9 1</size></heightmap>", "3000 x 3000 pixels", id="48"),
        pytest.param("<mesh><uri>gone.stl</uri></mesh>", "gone.stl: no such file or directory", id="37 in SDF"),
        pytest.param("<mesh><uri>../secret.stl</uri></mesh>", "outside the scenario root", id="38 in SDF"),
        pytest.param("<mesh><uri>fifo.stl</uri></mesh>", "not a regular file", id="40 in SDF"),
        pytest.param("<mesh><uri>lying.stl</uri></mesh>", "STL header says 9 triangles, file holds 0", id="41 in SDF"),
        pytest.param("<box><size>1 -1 1</size></box>", "1 -1 1", id="50 size in SDF"),
    ],
)  # fmt: skip
def test_unusable_sdf_geometry_is_an_error(with_world, folder: Path, geometry: str, told: str) -> None:
    (folder / "terrain.png").write_bytes(png(3000, 3000, b""))
    (folder / "lying.stl").write_bytes(bytes(80) + struct.pack("<I", 9))
    os.mkfifo(folder / "fifo.stl")
    head = with_world(SDF.format(geometry=geometry), "bad.sdf").splitlines()[0]
    assert head.startswith("bad.sdf:5:")
    assert told in head


def test_50_a_quaternion_of_zeros(with_world) -> None:
    pose = '<model name="thing"><pose rotation_format="quat_xyzw">0 0 0  0 0 0 0</pose>'
    text = (
        SDF.replace('<model name="thing">', pose).replace("1.7", "1.9").format(geometry="<box><size>1 1 1</size></box>")
    )
    head = with_world(text, "bad.sdf").splitlines()[0]
    assert head.startswith("bad.sdf:4:")
    assert "quaternion" in head


def test_problem_has_the_shortest_valid_path(refused, folder: Path, monkeypatch) -> None:
    (folder / "bad.scenario.yaml").write_text("- a list\n")
    deep = folder.parent / "/".join("a deep folder" for _ in range(60))
    deep.mkdir(parents=True)
    monkeypatch.chdir(deep)
    assert refused(folder / "bad.scenario.yaml").startswith(f"{folder}/bad.scenario.yaml:1:1: error[SC004]")
    monkeypatch.chdir(folder.parent)
    assert refused(folder / "bad.scenario.yaml").startswith("home/bad.scenario.yaml:1:1: error[SC004]")


@pytest.mark.parametrize(
    ("content", "place", "told"),
    [
        pytest.param("<sdf", "1:", "", id="43 truncated SDF"),
        pytest.param("", "1:", "", id="43 empty SDF"),
        pytest.param(SDF.replace("<sdf", "<!DOCTYPE sdf>\n<sdf"), "2:1", "DOCTYPE", id="42 in SDF"),
    ],
)
def test_unreadable_sdf_is_an_error(with_world, content: str, place: str, told: str) -> None:
    head = with_world(content, "bad.sdf").splitlines()[0]
    assert head.startswith(f"bad.sdf:{place}")
    assert told in head


def test_problem_in_a_world_path_folder_has_a_valid_path(folder: Path, refused) -> None:
    away = folder.parent / "away"
    away.mkdir()
    (away / "bad.sdf").write_text(SDF.format(geometry="<mesh><uri>gone.stl</uri></mesh>"))
    (away / "bad.robot.yaml").write_text(URDF_ROBOT)
    (away / "cube.urdf").write_text("<robot")
    text = (folder / "a.scenario.yaml").read_text()
    for old, new, file in (
        ("room.world.yaml", "bad.sdf", "bad.sdf"),
        ("cube.robot.yaml", "bad.robot.yaml", "cube.urdf"),
    ):
        (folder / "bad.scenario.yaml").write_text(text.replace(old, new))
        told = refused("bad.scenario.yaml", "--world-path", away)
        assert told.startswith(f"../away/{file}:")


@pytest.mark.parametrize(
    ("old", "new", "place", "told"),
    [
        pytest.param("x: 1.5, y: 1", "x: 3.2, y: 2.1", "5:16", 'goal `goal-1` (3.2, 2.1) is inside obstacle "crate"',
                     id="goal in obstacle"),
        pytest.param("x: 1.5, y: 1", "x: 0, y: 2", "5:16", 'goal `goal-1` (0, 2) is inside obstacle "wall_1"',
                     id="goal in wall"),
        pytest.param("x: 1.5, y: 1", "x: 2.45, y: 2", "5:16", 'closer to obstacle "crate"', id="too near"),
        pytest.param("x: 1.5, y: 1", "x: 60, y: 2", "5:16", "goal `goal-1` (60, 2) is outside the world", id="outside"),
        pytest.param("{x: 1, y: 1}", "{x: 3, y: 2}", "4:39", 'the robot\'s start (3, 2) is inside obstacle "crate"',
                     id="start in obstacle"),
        pytest.param("{x: 1, y: 1}", "{x: -9, y: 2}", "4:39", "the robot's start (-9, 2) is", id="start outside"),
    ],
)  # fmt: skip
def test_49_impossible_start_or_goal_is_an_error(with_scenario, old: str, new: str, place: str, told: str) -> None:
    head = with_scenario(replace={old: new}).splitlines()[0]
    assert head.startswith(f"bad.scenario.yaml:{place}: error[SC301]")
    assert told in head


@pytest.mark.parametrize(
    "thing",
    [
        "objects: [{name: cart, box: [0.4, 0.4, 1], pose: {x: 1, y: 1}}]",
        "doors: [{name: cart, points: [[0.5, 1], [1.5, 1]], closed: true}]",
    ],
)
def test_49_start_inside_a_movable_object_is_an_error(with_world, thing: str) -> None:
    told = with_world(f"simscen: 1\nwalls: [{{points: [[0, 0], [6, 0], [6, 4]]}}]\n{thing}\n")
    assert told.startswith('bad.scenario.yaml:4:39: error[SC301] the robot\'s start (1, 1) is inside obstacle "cart"')


def test_world_with_a_too_large_map_is_an_error(with_world) -> None:
    told = with_world("simscen: 1\nwalls: [{points: [[-9000, -9000], [9000, 9000]]}]\n")
    assert told.startswith("bad.scenario.yaml:3:8: error[SC330] map too large: 360042 x 360042 cells")


def test_49_goal_outside_the_robots_map_is_an_error(with_scenario, folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"P5 40 40 255\n" + b"\xff" * 1600)
    (folder / "old.yaml").write_text(MAP)
    told = with_scenario(replace={"seed: 7": "map: old.yaml", "x: 1.5, y: 1": "x: 4, y: 3"})
    assert told.startswith(
        "bad.scenario.yaml:5:16: error[SC301] goal `goal-1` (4, 3) is outside the map (2 m x 2 m from"
    )


def test_49_goal_without_a_map_can_be_beyond_the_obstacles(simscen, folder: Path) -> None:
    for name, old, new in (
        ("room.world.yaml", ", [0, 4], [0, 0]]", ", [0, 4]]"),  # open to the west
        ("a.scenario.yaml", "seed: 7", "map: none"),
        ("a.scenario.yaml", "x: 1.5", "x: -3"),
    ):
        (folder / name).write_text((folder / name).read_text().replace(old, new))
    assert simscen("validate", "a.scenario.yaml").out == "1 scenario is valid\n"


def test_49_impossible_goal_is_reported_quickly(cost, is_cheap, folder: Path) -> None:
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "a.scenario.yaml").write_text(text.replace("x: 1.5, y: 1", "x: 3.2, y: 2.1"))
    code, _, cpu, _ = cost("validate", "a.scenario.yaml")
    assert code == 2
    assert is_cheap(cpu)


@pytest.mark.parametrize(
    ("world", "place", "told"),
    [
        ("obstacles: [{name: a, box: [1, -1, 1], pose: {x: 3, y: 2}}]", "2:32", "must be greater than 0"),
        ("obstacles: [{name: a, cylinder: [0, 1], pose: {x: 3, y: 2}}]", "2:34", "must be greater than 0"),
        ("objects: [{name: a, box: [1, 1, 1], mass: -1, pose: {x: 3, y: 2}}]", "2:43", "must be at least 0"),
        ("walls: [{points: [[0, 0], [1, 0]], thickness: 0}]", "2:47", "must be greater than 0"),
        ("walls: [{points: [[0, 0]]}]", "2:18", "expected 2 or more values, got 1"),
    ],
)
def test_50_objects_without_size_are_errors(with_world, world: str, place: str, told: str) -> None:
    head = with_world(f"simscen: 1\n{world}\n").splitlines()[0]
    assert head.startswith(f"bad.world.yaml:{place}: error[SC0")
    assert told in head


def test_51_ids_that_differ_only_in_case_are_errors(refused, folder: Path) -> None:
    (folder / "A.scenario.yaml").write_text((folder / "a.scenario.yaml").read_text())
    assert "has the same id as `A.scenario.yaml`, except for case or suffix" in refused(".")
