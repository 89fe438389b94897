"""Test of the warning about goals on movable objects."""

import pytest

from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.scenario import load_scenario

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: wall, points: [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]}]
  objects: [{name: crate, box: [0.6, 0.6, 0.6], mass: 5 kg, pose: {x: 8, y: 2}}]
robot: {pose: {x: 1.5, y: 2}}
goals: [{pose: {x: 8, y: 2}}]
pass:
  - goals_reached: {}
"""
REMOVED = "events: [{when: {time: 1 s}, do: {remove: {name: crate}}}]\n"


@pytest.mark.parametrize(("more", "lines"), [("", [7]), (REMOVED, [])])
def test_goal_on_an_object_causes_a_warning_unless_the_object_moves(more, lines, tmp_path):
    file = tmp_path / "crate.scenario.yaml"
    file.write_text(SCENARIO + more)
    problems = check_in_world(load_scenario(file, tmp_path))
    assert [(p.line, p.code, p.severity) for p in problems] == [(line, "SC301", "warning") for line in lines]
    assert all("GOAL_OCCUPIED" in p.hint for p in problems)
