from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.problems import Problem
from simscen.loading.anyfile import kind_of, problems_of

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
    ],
)
def test_a_file_tells_its_kind_by_name_or_keys(write: Write, tmp_path: Path, name: str, text: str, kind: str) -> None:
    assert kind_of(write(name, text), tmp_path) == kind


def _problems(file: Path, root: Path) -> list[Problem]:
    return problems_of(kind_of(file, root), file, root)


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
