"""Tests of the semantic checks of scenarios."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.errors import Problem
from tests.scenario_files import try_scenario

Write = Callable[[str, str], Path]
ProblemsOf = Callable[[str], list[Problem]]


@pytest.fixture
def problems_with(write: Write, scenario: str, tmp_path: Path) -> ProblemsOf:
    """Return the problems of the valid scenario with additional lines."""

    def problems(lines: str) -> list[Problem]:
        found = try_scenario(write("a.scenario.yaml", scenario + lines), tmp_path)
        return found if isinstance(found, list) else []

    return problems


def test_the_scenario_without_additional_lines_is_consistent(problems_with: ProblemsOf) -> None:
    assert problems_with("") == []


@pytest.mark.parametrize(
    "trigger",
    [
        "{robot_in: {region: hall}}",
        "{robot_within: {object: cart, distance: 1}}",
        "{robot_within: {object: box, distance: 1}}",
        "{event: {name: falls}}",
        "{event: {name: event-2}}",
        "{goal: {name: desk, status: reached}}",
        "{goal: {name: detour, status: reached}}",
        "{all: [{time: 1}, {not: {any: [{robot_in: {region: hall}}]}}]}",
    ],
)
def test_names_of_the_world_and_of_the_scenario_are_known(problems_with: ProblemsOf, trigger: str) -> None:
    events = "- {name: falls, when: {time: 1}, do: {spawn: {name: box, box: [1, 1, 1], ahead: [1, 0]}}}"
    more = "- {when: {time: 2}, do: [{new_goal: {name: detour, pose: {x: 1, y: 1}}}]}"
    assert problems_with(f"events:\n  {events}\n  {more}\n  - {{when: {trigger}, do: {{cancel_goal: {{}}}}}}\n") == []


@pytest.mark.parametrize(
    "trigger",
    [
        "{robot_in: {region: halls}}",
        "{robot_within: {region: halls, distance: 1}}",
        "{robot_within: {object: cartoon, distance: 1}}",
        "{event: {name: event-2}}",
        "{goal: {name: goal-1, status: reached}}",
        "{all: [{time: 1}, {not: {any: [{robot_in: {region: halls}}]}}]}",
        "{collision: {with: nobody}}",
    ],
)
def test_unknown_names_are_reported_everywhere(problems_with: ProblemsOf, trigger: str) -> None:
    problems = problems_with(f"events:\n  - {{when: {trigger}, do: {{cancel_goal: {{}}}}}}\n")
    assert [(p.code, p.line) for p in problems] == [("SC030", 7)]


def test_criteria_may_wait_for_faults_by_label_or_name(problems_with: ProblemsOf) -> None:
    faults = "faults: [{sensor: front, off: {}}, {sensor: odom, slip: {}, name: wet}]\n"
    text = faults + "events: [{name: x, when: {time: 1}, do: {cancel_goal: {}}}]\n"
    criteria = "".join(f"- stopped_within: {{time: 1, after: {name}}}\n" for name in ("front.off", "wet", "x"))
    assert problems_with(text + "pass:\n" + criteria)[0].code == "SC007"  # the scenario has a `pass` already
    assert problems_with(text) == []


def test_objects_of_imported_worlds_are_not_second_guessed(write: Write, scenario: str, tmp_path: Path) -> None:
    write("hall.sdf", "<sdf/>")
    text = (
        scenario.replace("room.world.yaml", "hall.sdf").replace("start", "{x: 1, y: 1}").replace("desk", "{x: 1, y: 2}")
    )
    more = "events: [{when: {collision: {with: shelf}}, do: {cancel_goal: {}}}]\n"
    assert not isinstance(try_scenario(write("a.scenario.yaml", text + more), tmp_path), list)


def test_a_fault_must_fit_its_sensor(problems_with: ProblemsOf) -> None:
    problems = problems_with("faults:\n  - {sensor: front, slip: {left: 10 %}}\n  - {sensor: rear, off: {}}\n")
    assert [(p.code, p.line, p.col) for p in problems] == [("SC032", 7, 21), ("SC031", 8, 14)]
    assert problems[0].hint == "it can affect: odom, wheels"
    assert problems[1].hint == "expected one of: front, odom, cmd_vel, wheels, localizer, map"


def test_rates_must_divide_the_ticks_where_they_are_written(write: Write, problems_with: ProblemsOf) -> None:
    assert [p.place for p in problems_with("stack: {controller_frequency: 7}\n")] == ["a.scenario.yaml:6:31"]
    robot = (write("x", "").parent / "cube.robot.yaml").read_text()
    write("cube.robot.yaml", robot.replace("10 Hz", "11 Hz"))
    problem = problems_with("")[0]
    assert problem.place == "cube.robot.yaml:8:25"
    assert problem.message.endswith("11 Hz does not divide 240 Hz; the nearest that does is 10 Hz")


def test_two_goals_at_one_place_are_fine_but_two_of_one_name_are_not(
    write: Write, scenario: str, tmp_path: Path
) -> None:
    twice = scenario.replace("[{pose: desk}]", "[{pose: desk}, {pose: start}, {pose: desk}]")
    assert not isinstance(try_scenario(write("a.scenario.yaml", twice), tmp_path), list)
    named = scenario.replace("[{pose: desk}]", "[{name: a, pose: desk}, {name: a, pose: start}]")
    problems = try_scenario(write("b.scenario.yaml", named), tmp_path)
    assert isinstance(problems, list)
    assert [p.message for p in problems] == ["goal `a` is already defined at 4:16"]
