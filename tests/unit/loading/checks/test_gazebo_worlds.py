"""Tests of starts, goals, and maps of scenarios in Gazebo worlds."""

from pathlib import Path

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import FREE
from simscen.core.errors import InvalidInput, Problem
from simscen.loading.builders import load_world
from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.run.disk_cache import DiskCache
from simscen.run.preparation import prepare
from simscen.run.scenario_cache import CachedWorldBuilder, ScenarioCache

GROUND = "<include><uri>model://ground_plane</uri></include>"
SCENARIO = """
simscen: 1
world: w.sdf
{lines}
robot: {{pose: {{x: 0, y: 0}}}}
goals: [{{pose: {goal}}}]
time_limit: 300 s
pass: [{criterion}]
"""


def box(name: str, x: float, size: tuple[float, float, float], z: float | None = None) -> str:
    z = size[2] / 2 if z is None else z
    shape = f"<geometry><box><size>{size[0]} {size[1]} {size[2]}</size></box></geometry>"
    link = f"<link name='l'><collision name='c'>{shape}</collision></link>"
    return f"<model name='{name}'><static>1</static><pose>{x} 0 {z} 0 0 0</pose>{link}</model>"


WALL = box("wall", 3, (0.2, 2, 1))


def load(
    folder: Path,
    content: str,
    goal: str = "{x: -2, y: 0}",
    lines: str = "",
    criterion: str = "goals_reached: {}",
) -> LoadedScenario:
    (folder / "w.sdf").write_text(f"<sdf version='1.6'><world name='w'>{content}</world></sdf>")
    file = folder / "a.scenario.yaml"
    file.write_text(SCENARIO.format(goal=goal, lines=lines, criterion=criterion))
    return load_scenario(file, folder)


def errors(loaded: LoadedScenario) -> list[Problem]:
    return [problem for problem in check_in_world(loaded) if problem.severity == "error"]


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(GROUND, id="only a ground plane"),
        pytest.param(GROUND + WALL, id="beside the only wall"),
        pytest.param(box("asphalt", 0, (200, 200, 0.1), z=0) + WALL, id="a floor too large for a map"),
        pytest.param(GROUND + box("asphalt", 0, (300, 300, 0.1), z=-0.05) + WALL, id="a floor at z = 0"),
    ],
)
def test_map_covers_start_and_goals_on_open_ground(tmp_path, content):
    loaded = load(tmp_path, content)
    assert not errors(loaded)
    for prepared in (prepare(loaded), ScenarioCache(CachedWorldBuilder(DiskCache(None))).get_or_prepare(loaded)):
        assert prepared.map is not None
        stops = prepared.map.cell_of(np.array([prepared.start[:2], prepared.case.goals[0].pose[:2]]))
        assert prepared.map.inside(stops).all()
        assert (prepared.map.cells[stops[:, 0], stops[:, 1]] == FREE).all()
        assert prepared.map.cells.size < 1e5


def test_goal_that_is_expected_to_fail_does_not_extend_the_map(tmp_path):
    criterion = "error_code: {code: GOAL_OUTSIDE_MAP}"
    loaded = load(tmp_path, GROUND + WALL, "{x: 40, y: 0}", criterion=criterion)
    assert not errors(loaded)
    grid = prepare(loaded).map
    assert not grid.inside(grid.cell_of(np.array([[40, 0]]))).any()


def test_start_outside_a_world_without_ground_mentions_a_run_without_map(tmp_path):
    found = errors(load(tmp_path, WALL))
    assert [problem.message.partition(" is ")[2] for problem in found] == ["outside the world (2.9 … 3.1, -1 … 1)"] * 2
    assert all("`map: none`" in problem.hint for problem in found)


def test_start_on_a_platform_has_a_hint_about_its_height(tmp_path):
    found = errors(load(tmp_path, GROUND + box("tile", 0, (6, 6, 0.1), z=0) + box("wall", 8, (0.2, 6, 1))))
    assert {problem.code for problem in found} == {"SC301"}
    assert all("robots start at z = 0" in problem.hint and "by 0.05 m" in problem.hint for problem in found)


STAGE = box("a", 2, (0.5, 0.5, 1)) + box("stage", 2, (500, 500, 0.4), z=1)


def test_message_about_a_too_large_map_names_the_model(tmp_path):
    [problem] = errors(load(tmp_path, GROUND + STAGE))
    assert problem.code == "SC330"
    assert '"stage" makes the map large' in problem.hint


@pytest.mark.parametrize("floor", [GROUND, box("asphalt", 0, (500, 500, 0.1))], ids=["plane", "slab"])
def test_goal_too_far_away_for_a_map_is_an_error(tmp_path, floor):
    [problem] = errors(load(tmp_path, floor + WALL, "{x: 230, y: 230}"))
    assert (problem.code, problem.hint.partition(",")[0]) == ("SC330", "move the start and the goals closer together")


def test_without_a_map_a_world_may_be_larger_than_any_map(tmp_path):
    loaded = load(tmp_path, GROUND + STAGE, lines="map: none")
    assert not errors(loaded)
    assert prepare(loaded).map is None


WORLD_FILE = """
simscen: 1
sdf: w.sdf
objects:
  - {name: cart, box: [0.5, 0.5, 0.5], mass: 5, pose: {x: 3, y: 3}}
doors:
  - {name: gate, points: [[4, 4], [5, 4]]}
"""


def test_object_with_the_name_of_a_model_is_an_error_in_the_world_file(tmp_path):
    movable = box("cart", 3, (0.5, 0.5, 0.5)).replace("<static>1</static>", "")
    load(tmp_path, GROUND + WALL + movable)
    (tmp_path / "w.world.yaml").write_text(WORLD_FILE)
    scenario = tmp_path / "a.scenario.yaml"
    scenario.write_text(scenario.read_text().replace("world: w.sdf", "world: w.world.yaml"))
    with pytest.raises(InvalidInput) as caught:
        load_world(load_scenario(scenario, tmp_path))
    [problem] = caught.value.problems
    assert (problem.path, problem.line, problem.col, problem.code) == ("w.world.yaml", 5, 12, "SC033")
    assert problem.source == WORLD_FILE.split("\n")[4]
