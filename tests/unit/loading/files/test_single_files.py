"""Tests of reading and writing world files."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.files.assets import Assets
from simscen.loading.files.paths import PathSandbox
from simscen.loading.files.single_files import load_robot_file, load_world_file
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.writing import world_text

WORLDS = sorted((Path(__file__).parents[4] / "worlds").glob("*.world.yaml"))


@pytest.mark.parametrize("file", WORLDS, ids=lambda file: file.name)
def test_a_world_that_is_written_reads_back_the_same(file: Path, tmp_path: Path) -> None:
    spec = load_world_file(file, file.parent).spec
    assert spec is not None
    (tmp_path / "copy.world.yaml").write_text(world_text(spec), encoding="utf-8")
    assert load_world_file(tmp_path / "copy.world.yaml", tmp_path).spec == spec


def test_each_object_takes_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.world.yaml").write_text(
        "simscen: 1\nname: a\nobstacles:\n- name: x\n  box: [1, 2, 3]\n  pose:\n    x: 1\n    y: 90 cm\n"
        "places: {p: {x: 1, y: 2}}\nregions: {r: [[0, 0], [1, 0], [1, 1]]}\n"
    )
    spec = load_world_file(tmp_path / "a.world.yaml", tmp_path).spec
    assert spec is not None
    assert world_text(spec) == (
        "simscen: 1\nname: a\nobstacles:\n- {name: x, box: [1.0, 2.0, 3.0], pose: {x: 1.0, y: 0.9}}\n"
        "places:\n  p: {x: 1.0, y: 2.0}\nregions:\n  r: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]\n"
    )


def test_sdf_worlds_and_ros_maps_are_recognized_by_content(tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(b"P5 1 1 255\n\x00")
    (tmp_path / "m.yaml").write_text("image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    (tmp_path / "s.sdf.xacro").write_text("<sdf version='1.6'/>")
    assert load_world_file(tmp_path / "m.yaml", tmp_path).map is not None
    assert load_world_file(tmp_path / "s.sdf.xacro", tmp_path).sdf == tmp_path / "s.sdf.xacro"


@pytest.mark.parametrize("is_xml", [False, True])
def test_unsaved_text_decides_whether_a_world_is_xml(tmp_path: Path, is_xml: bool) -> None:
    texts = ["simscen: 1\n", "<sdf version='1.6'/>"]
    file = tmp_path / "a.world.yaml"
    file.write_text(texts[not is_xml])
    assets = Assets(Library(PathSandbox.around(tmp_path, ()), unsaved={file: texts[is_xml]}))
    world = assets.world_file(file)
    assert (world is None) == is_xml
    assert ["this is an XML file" in problem.message for problem in assets.problems] == [True] * is_xml


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("nowhere.world.yaml", "no such file or directory"),
        (".", "not a regular file"),
        ("bad.world.yaml", "unknown key `wals`"),
        ("../outside.world.yaml", "outside the scenario root"),
        ("hall.model", "this is an XML file"),
    ],
)
def test_invalid_world_is_reported(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / "root").mkdir()
    (tmp_path / "outside.world.yaml").write_text("simscen: 1\n")
    (tmp_path / "root/bad.world.yaml").write_text("simscen: 1\nwals: []\n")
    (tmp_path / "root/hall.model").write_text("\n<?xml version='1.0'?><sdf version='1.6'/>")
    with pytest.raises(InvalidInput, match=text):
        load_world_file(tmp_path / "root" / name, tmp_path / "root")


def test_a_name_that_is_too_long_for_a_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no such file or shipped robot"):
        load_robot_file("a" * 300, Path.cwd())
    with pytest.raises(InvalidInput, match="no such file or directory"):
        load_world_file(tmp_path / ("a" * 300), tmp_path)
