"""Conformance tests of invalid worlds, and of starts and goals that are impossible in a world."""

import os
import struct
from pathlib import Path

import pytest
from PIL import Image

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


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        pytest.param("<heightmap><uri>terrain.png</uri><size>9 9 1</size></heightmap>", "3000 x 3000 pixels", id="48"),
        pytest.param("<mesh><uri>gone.stl</uri></mesh>", "gone.stl: no such file or directory", id="37 in SDF"),
        pytest.param("<mesh><uri>../secret.stl</uri></mesh>", "outside the scenario root", id="38 in SDF"),
        pytest.param("<mesh><uri>fifo.stl</uri></mesh>", "not a regular file", id="40 in SDF"),
        pytest.param("<mesh><uri>lying.stl</uri></mesh>", "STL header says 9 triangles, file holds 0", id="41 in SDF"),
        pytest.param("<box><size>1 -1 1</size></box>", "1 -1 1", id="50 size in SDF"),
    ],
)  # fmt: skip
def test_unusable_sdf_geometry_is_an_error(with_world, folder: Path, geometry: str, message: str) -> None:
    Image.new("1", (3000, 3000)).save(folder / "terrain.png")
    (folder / "lying.stl").write_bytes(bytes(80) + struct.pack("<I", 9))
    os.mkfifo(folder / "fifo.stl")
    head = with_world(SDF.format(geometry=geometry), "bad.sdf").splitlines()[0]
    assert head.startswith("bad.sdf:5:")
    assert message in head


def test_50_zero_quaternion_is_an_error(with_world) -> None:
    pose = '<model name="thing"><pose rotation_format="quat_xyzw">0 0 0  0 0 0 0</pose>'
    text = (
        SDF.replace('<model name="thing">', pose).replace("1.7", "1.9").format(geometry="<box><size>1 1 1</size></box>")
    )
    head = with_world(text, "bad.sdf").splitlines()[0]
    assert head.startswith("bad.sdf:4:")
    assert "quaternion" in head


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        pytest.param("<sdf", "1:", "", id="43 truncated SDF"),
        pytest.param("", "1:", "", id="43 empty SDF"),
        pytest.param(SDF.replace("<sdf", "<!DOCTYPE sdf>\n<sdf"), "2:1", "DOCTYPE", id="42 in SDF"),
    ],
)
def test_unreadable_sdf_is_an_error(with_world, content: str, place: str, message: str) -> None:
    head = with_world(content, "bad.sdf").splitlines()[0]
    assert head.startswith(f"bad.sdf:{place}")
    assert message in head


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
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
def test_49_impossible_start_or_goal_is_an_error(with_scenario, old: str, new: str, place: str, message: str) -> None:
    head = with_scenario(replace={old: new}).splitlines()[0]
    assert head.startswith(f"bad.scenario.yaml:{place}: error[SC301]")
    assert message in head


@pytest.mark.parametrize(
    "item",
    [
        "objects: [{name: cart, box: [0.4, 0.4, 1], pose: {x: 1, y: 1}}]",
        "doors: [{name: cart, points: [[0.5, 1], [1.5, 1]], closed: true}]",
    ],
)
def test_49_start_inside_a_movable_object_is_an_error(with_world, item: str) -> None:
    text = with_world(f"simscen: 1\nwalls: [{{points: [[0, 0], [6, 0], [6, 4]]}}]\n{item}\n")
    assert text.startswith('bad.scenario.yaml:4:39: error[SC301] the robot\'s start (1, 1) is inside obstacle "cart"')


def test_49_goal_without_a_map_can_be_beyond_the_obstacles(simscen, folder: Path) -> None:
    for name, old, new in (
        ("room.world.yaml", ", [0, 4], [0, 0]]", ", [0, 4]]"),  # open to the west
        ("a.scenario.yaml", "seed: 7", "map: none"),
        ("a.scenario.yaml", "x: 1.5", "x: -3"),
    ):
        (folder / name).write_text((folder / name).read_text().replace(old, new))
    assert simscen("validate", "a.scenario.yaml").out == "1 scenario is valid\n"


def test_49_impossible_goal_is_an_error(simscen, folder: Path) -> None:
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "a.scenario.yaml").write_text(text.replace("x: 1.5, y: 1", "x: 3.2, y: 2.1"))
    assert simscen("validate", "a.scenario.yaml").code == 2


@pytest.mark.parametrize(
    ("world", "place", "message"),
    [
        ("obstacles: [{name: a, box: [1, -1, 1], pose: {x: 3, y: 2}}]", "2:32", "must be greater than 0"),
        ("obstacles: [{name: a, cylinder: [0, 1], pose: {x: 3, y: 2}}]", "2:34", "must be greater than 0"),
        ("objects: [{name: a, box: [1, 1, 1], mass: -1, pose: {x: 3, y: 2}}]", "2:43", "must be at least 0"),
        ("walls: [{points: [[0, 0], [1, 0]], thickness: 0}]", "2:47", "must be greater than 0"),
        ("walls: [{points: [[0, 0]]}]", "2:18", "expected 2 or more values, got 1"),
    ],
)
def test_50_objects_without_size_are_errors(with_world, world: str, place: str, message: str) -> None:
    head = with_world(f"simscen: 1\n{world}\n").splitlines()[0]
    assert head.startswith(f"bad.world.yaml:{place}: error[SC0")
    assert message in head


def test_51_ids_that_differ_only_in_case_are_errors(refused, folder: Path) -> None:
    (folder / "A.scenario.yaml").write_text((folder / "a.scenario.yaml").read_text())
    assert "has the same id as `A.scenario.yaml`, except for case or suffix" in refused(".")
