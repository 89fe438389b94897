"""Tests of checks of all kinds of files."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.checks.files import check_file, file_kind

Write = Callable[[str, str], Path]


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.scenario.yaml", "x: 1", "scenario"),
        ("a.world.yaml", "x: 1", "world"),
        ("a.robot.yaml", "x: 1", "robot"),
        ("a.sdf", "<sdf/>", "world"),
        ("a.urdf", "<robot/>", "robot"),
        ("a.yaml", "image: a\nresolution: 1", "map"),
        ("a.yaml", "simscen: 1\npass: []", "scenario"),
        ("a.yaml", "simscen: 1\ndrive: {}", "robot"),
        ("a.yaml", "simscen: 1\nwalls: []", "world"),
        ("a.yaml", "not even [yaml", "scenario"),
        ("a.yaml", "simscen: 1\nname: mine\nstack: {}", "stack"),
        ("a.yaml", "simscen: 1\nworld: a\nstack: {}", "scenario"),
        ("a.yaml", "amcl: {ros__parameters: {alpha1: 0.1}}", "parameter file of Nav2"),
        ("a.yaml", "robot1:\n  /**: {ros__parameters: {a: 1, a: 2}}", "parameter file of Nav2"),
        ("a.scenario.yaml", "amcl: {ros__parameters: {alpha1: 0.1}}", "scenario"),
    ],
)
def test_kind_of_a_file_is_found_by_name_or_keys(write: Write, tmp_path: Path, name: str, text: str, kind: str) -> None:
    assert file_kind(write(name, text), tmp_path) == kind


def _problems(file: Path, root: Path) -> list[Problem]:
    return check_file(file_kind(file, root), file, root)


def test_every_kind_is_checked(write: Write, scenario: str, tmp_path: Path) -> None:
    write("a.scenario.yaml", scenario)
    for name in ("a.scenario.yaml", "room.world.yaml", "cube.robot.yaml"):
        assert _problems(tmp_path / name, tmp_path) == []
    write("map.yaml", "image: no.pgm\nresolution: 1\norigin: [0, 0, 0]\n")
    assert [p.place for p in _problems(tmp_path / "map.yaml", tmp_path)] == ["map.yaml:1:8"]


def test_a_robot_is_checked_down_to_its_urdf(write: Write, tmp_path: Path) -> None:
    robot = (tmp_path / "cube.robot.yaml").read_text().replace("body: [{box: [0.3, 0.3, 0.3]}]", "urdf: cube.urdf")
    write("cube.robot.yaml", robot)
    assert [p.code for p in _problems(tmp_path / "cube.robot.yaml", tmp_path)] == ["SC023"]


def test_paths_may_be_relative_to_the_working_folder(
    write: Write, scenario: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("a.scenario.yaml", scenario)
    monkeypatch.chdir(tmp_path)
    for name in ("a.scenario.yaml", "room.world.yaml"):
        assert _problems(Path(name), Path()) == []


PARAMETERS = "amcl:\n  ros__parameters: {alpha1: 0.1, beta: 2}\ndocking_server:\n  ros__parameters: {a: 1}\n"


def test_ignored_and_wrong_nav2_parameters_are_reported(write: Write, tmp_path: Path) -> None:
    expected = _problems(write("nav2.yaml", PARAMETERS), tmp_path)
    assert [(p.place, p.code, p.severity) for p in expected] == [
        ("nav2.yaml:2:40", "SC341", "warning"),
        ("nav2.yaml:4:24", "SC341", "warning"),
    ]
    wrong = _problems(write("nav2.yaml", PARAMETERS.replace("alpha1: 0.1", "alpha1: -1.0")), tmp_path)
    assert [(p.place, p.code, p.severity) for p in wrong] == [("nav2.yaml:2:29", "SC013", "error")]


@pytest.mark.parametrize(
    ("text", "kind", "hint"),
    [
        (PARAMETERS, "a parameter file of Nav2", "run scenarios with `--stack NAME=mine.yaml`"),
        ("simscen: 1\nstack: {}", "a stack file", "run scenarios with `--stack NAME=mine.yaml`"),
        ("simscen: 1\nwalls: []\nplaces: {}", "a world file", "name it in a scenario: `world: mine.yaml`"),
        ("simscen: 1\ndrive: {}\nlimits: {}", "a robot file", "name it in a scenario: `robot: {model: mine.yaml}`"),
        ("image: a.pgm\nresolution: 1", "a ROS map", "name it in a scenario: `world: mine.yaml`"),
        ("<?xml version='1.0'?>\n<sdf/>", "an XML file", "name a world or a robot in a scenario: `world: mine.yaml`"),
        ("<robot name='x'/>", "an XML file", "name a world or a robot in a scenario: `world: mine.yaml`"),
    ],
)
def test_file_of_another_kind_is_no_scenario_and_gets_a_hint(
    write: Write, tmp_path: Path, text: str, kind: str, hint: str
) -> None:
    (problem,) = check_file("scenario", write("mine.yaml", text), tmp_path)
    expected = f"this is {kind}, not a scenario"
    assert (problem.place, problem.code, problem.message) == ("mine.yaml", "SC025", expected)
    assert problem.hint.startswith(hint)


def test_merge_key_of_yaml_is_no_xml(write: Write, tmp_path: Path) -> None:
    problems = check_file("scenario", write("a.yaml", "<<: {simscen: 1}"), tmp_path)
    assert "SC025" not in [problem.code for problem in problems]


@pytest.mark.parametrize(
    ("kind", "message", "hint"),
    [
        ("world", "expected a world in YAML", "if it is SDF, rename it to .sdf or .world"),
        ("robot", "expected a robot in YAML", "if it is a URDF, rename it to .urdf; robots in SDF are not supported"),
        ("map", "expected a ROS map in YAML", "`simscen world export` writes its map"),
    ],
)
def test_xml_file_with_the_suffix_of_yaml_gets_a_hint(
    write: Write, tmp_path: Path, kind: str, message: str, hint: str
) -> None:
    (problem,) = check_file(kind, write("mine.yaml", "<?xml version='1.0'?>\n<sdf/>"), tmp_path)
    assert problem.message == f"this is an XML file, {message}"
    assert hint in problem.hint
