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
def prepare_two_robots(tmp_path: Path):
    """Return a function that prepares a scenario of two robots; the second has the given faults."""

    def prepare_with(faults: str = "") -> PreparedScenario:
        (tmp_path / "a.scenario.yaml").write_text(SCENARIO.replace("FAULTS", faults))
        return prepare(load_scenario(tmp_path / "a.scenario.yaml", tmp_path))

    return prepare_with


def test_robots_without_map_faults_use_the_prepared_scenario(prepare_two_robots) -> None:
    prepared = prepare_two_robots()
    assert apply_map_faults(prepared, seed=1) is prepared


def test_only_the_robot_with_a_map_fault_gets_another_map(prepare_two_robots) -> None:
    prepared = prepare_two_robots(", faults: [{sensor: map, shift: {x: 10 cm}}]")
    run = apply_map_faults(prepared, seed=1)
    assert run.robots["a"] is prepared.robots["a"]
    assert run.robots["b"].map_faults == (0,)
    assert run.robots["b"].map is not prepared.robots["b"].map
