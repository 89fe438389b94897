"""Tests of the map of each robot, with and without a map fault."""

from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run.faults.map_faults import apply_map_faults
from simscen.run.preparation import PreparedScenario, prepare

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}]
robots:
  a: {pose: {x: 1, y: 1}, goals: [{pose: {x: 1.5, y: 1}}]}
  b: {pose: {x: 3, y: 3}, goals: [{pose: {x: 2.5, y: 3}}]FAULTS}
time_limit: 6
pass: [{goals_reached: {}}]
"""


@pytest.fixture
def two(tmp_path: Path):
    """Two robots, the second with some faults."""

    def prepared(faults: str = "") -> PreparedScenario:
        (tmp_path / "a.scenario.yaml").write_text(SCENARIO.replace("FAULTS", faults))
        return prepare(load_scenario(tmp_path / "a.scenario.yaml", tmp_path))

    return prepared


def test_robots_without_map_faults_use_the_prepared_scenario(two) -> None:
    prepared = two()
    assert apply_map_faults(prepared, seed=1) is prepared


def test_only_the_robot_with_a_map_fault_gets_another_map(two) -> None:
    prepared = two(", faults: [{sensor: map, shift: {x: 10 cm}}]")
    run = apply_map_faults(prepared, seed=1)
    assert run.robots["a"] is prepared.robots["a"]
    assert run.robots["b"].map_faults == (0,)
    assert run.robots["b"].map is not prepared.robots["b"].map
