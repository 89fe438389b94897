"""Test that the wall between robot and goal is named."""

from pathlib import Path

import pytest

from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.scenario import load_scenario

HALL = """
simscen: 1
world:
  simscen: 1
  walls:
    - {name: outer, points: [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]}
    - {name: middle, points: %s}
robot: {pose: {x: 2, y: 3}}
goals: [{pose: {x: 8, y: 3}}]
pass: [{goals_reached: {}}]
"""


@pytest.mark.parametrize("points", ["[[5, 0], [5, 6]]", "[[5.02, 0], [5.02, 6]]", "[[5, 0], [4, 6]]"])
def test_a_wall_that_cuts_a_hall_in_two_is_named_and_not_a_corner_of_the_outer_wall(
    tmp_path: Path, points: str
) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(HALL % points)
    (problem,) = check_in_world(load_scenario(file, tmp_path))
    assert problem.code == "SC302"
    assert "`middle` closes the last route at (" in problem.message
