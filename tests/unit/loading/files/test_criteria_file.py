"""Tests of files with criteria for logs."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.files.criteria_file import load_criteria


def test_robot_of_a_criteria_file_needs_no_start_pose(tmp_path: Path) -> None:
    file = tmp_path / "limits.yaml"
    file.write_text("robot: {model: jackal}\npass: [{speed: {max: 1}}]\n")
    _, robot = load_criteria(file, tmp_path).load_world_and_robot()
    assert robot is not None and robot.spec.name == "jackal"


def test_robots_of_a_criteria_file_need_only_their_criteria(tmp_path: Path) -> None:
    file = tmp_path / "limits.yaml"
    file.write_text("robots: {a: {pass: [{speed: {max: 1}}]}, b: {}}\npass: [{collisions: {max: 0}}]\n")
    criteria = load_criteria(file, tmp_path)
    kinds = {name: [entry.kind for entry in criteria.for_robot(name).spec.pass_] for name in ("a", "b")}
    assert kinds == {"a": ["collisions", "speed"], "b": ["collisions"]}
    with pytest.raises(InvalidInput, match="the log has a robot `c`, which is not listed here"):
        criteria.for_robot("c")
