"""Tests of named places instead of poses and points."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.files.criteria_file import load_criteria
from simscen.loading.files.single_files import load_world_file
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import criteria_of_text, resolved_text
from simscen.spec.places import PoseSpec
from tests.scenario_files import spec_of_text, try_scenario

Write = Callable[[str, str], Path]
NEAR_DESK = "pass: [{always: {signal: distance_to, point: desk, op: '>=', value: 0.1}}]"
EVENTS = """\
events:
  - {when: {robot_within: {of: desk, distance: 1}}, do: {kidnap: {pose: start}}}
  - {when: {time: 1}, do: {spawn: {name: crate, box: [1, 1, 1], pose: start}}}
  - {when: {time: 2}, do: {move: {name: cart, through: [desk, [4, 1], start], speed: 1}}}
  - {when: {time: 3}, do: {new_goal: {name: back, pose: start}}}
"""


@pytest.fixture
def load(write: Write, tmp_path: Path) -> Callable[[str], LoadedScenario]:
    return lambda text: load_scenario(write("a.scenario.yaml", text), tmp_path)


@pytest.fixture
def expected(write: Write, tmp_path: Path) -> Callable[[str], list[str]]:
    def problems(text: str) -> list[str]:
        found = try_scenario(write("a.scenario.yaml", text), tmp_path)
        return (
            [f"{p.line}:{p.col} {p.code} {p.hint}" for p in found if isinstance(p, Problem)]
            if isinstance(found, list)
            else []
        )

    return problems


def test_actions_and_triggers_get_the_poses_of_places(load, scenario: str) -> None:
    near, spawn, move, goal = load(scenario + EVENTS).spec.events
    assert near.when.robot_within.of == [5, 3]
    assert near.do.kidnap.pose.pose == (1, 1, 0) == spawn.do.spawn.pose.pose == goal.do.new_goal.pose.pose
    assert move.do.move.through == [[5, 3], [4, 1], [1, 1]]


def test_goals_may_be_a_list_of_places_and_are_called_after_them(load, scenario: str) -> None:
    spec = load(scenario.replace("[{pose: desk}]", "[desk, start, {pose: desk}, {pose: {x: 2, y: 2}}]")).spec
    assert [goal.pose.pose for goal in spec.goals] == [(5, 3, 0), (1, 1, 0), (5, 3, 0), (2, 2, 0)]
    assert spec.goal_names == ["desk", "start", "desk-2", "goal-4"]


def test_a_goal_after_a_place_takes_no_name_that_another_has(load, scenario: str) -> None:
    written = "[desk, {name: desk-2, pose: start}, desk, {name: goal-5, pose: start}, {pose: {x: 2, y: 2}}]"
    names = load(scenario.replace("[{pose: desk}]", written)).spec.goal_names
    assert names == ["desk", "desk-2", "desk-3", "goal-5", "goal-5-2"]


def test_initial_estimate_can_be_a_place_or_unknown(load, scenario: str) -> None:
    expected = load(scenario.replace("pose: start", "pose: start, initial_estimate: desk")).spec.robot.initial_estimate
    assert expected.pose == (5, 3, 0)
    assert expected.std == (0.5, 0.5, 0.2618)
    unknown = load(scenario.replace("pose: start", "pose: start, initial_estimate: unknown")).spec
    assert unknown.robot.initial_estimate == "unknown"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("goals: [disk]", "4:9"),
        ("goals: [{pose: disk}]", "4:16"),
        ("goals: [desk]\nevents: [{when: {time: 1}, do: {kidnap: {pose: disk}}}]", "5:48"),
        ("goals: [desk]\nevents: [{when: {robot_within: {of: disk, distance: 1}}, do: {cancel_goal: {}}}]", "5:37"),
        ("goals: [desk]\nevents: [{when: {time: 1}, do: {move: {name: cart, through: [disk], speed: 1}}}]", "5:62"),
    ],
)
def test_unknown_place_is_reported_with_a_suggestion(expected, scenario: str, text: str, place: str) -> None:
    assert expected(scenario.replace("goals: [{pose: desk}]", text)) == [f"{place} SC030 did you mean `desk`?"]


def test_objects_of_a_world_can_be_at_its_places(write: Write, tmp_path: Path) -> None:
    text = """\
simscen: 1
walls: [{points: [west, east, [4, 0]]}]
objects: [{name: cart, box: [1, 1, 1], pose: west, move: {through: [east], speed: 1}}]
doors: [{name: door, points: [west, [0, 1]]}]
places: {west: {x: 0, y: 2, yaw: 1}, east: {x: 4, y: 2}}
"""
    spec = load_world_file(write("b.world.yaml", text), tmp_path).spec
    assert spec is not None
    assert spec.walls[0].points == [[0, 2], [4, 2], [4, 0]]
    assert spec.objects[0].pose.pose == (0, 2, 1)
    assert spec.objects[0].move.through == [[4, 2]]
    assert spec.doors[0].points == [[0, 2], [0, 1]]


def test_unknown_place_in_a_world_is_reported_in_the_world_file(expected, write: Write, scenario: str) -> None:
    world = (write("x", "").parent / "room.world.yaml").read_text()
    write("room.world.yaml", world.replace("pose: {x: 3, y: 2}", "pose: dusk"))
    assert expected(scenario) == ["5:44 SC030 did you mean `desk`?"]


def test_a_resolved_scenario_can_be_loaded_again_and_judges_without_its_world(load, scenario: str) -> None:
    loaded = load(scenario.replace("pass: [{goals_reached: {}}]", NEAR_DESK))
    text = resolved_text(loaded)
    assert spec_of_text(text, "a").goals[0].pose == "desk"
    assert criteria_of_text(text, "a", {}).pass_[0].always.point == [5, 3]
    assert resolved_text(load(scenario)) == scenario


def test_a_file_of_criteria_takes_places_of_the_world_that_it_names(write: Write, tmp_path: Path) -> None:
    with_world = write("c.yaml", f"world: room.world.yaml\n{NEAR_DESK}\n")
    assert load_criteria(with_world, tmp_path).spec.pass_[0].always.point == [5, 3]


def test_a_pose_of_a_place_is_equal_to_one_written_out_but_for_its_name() -> None:
    here = PoseSpec(x=1, y=2)
    assert here.with_place("desk").pose == here.pose
    assert (here.with_place("desk").place, here.place) == ("desk", "")
