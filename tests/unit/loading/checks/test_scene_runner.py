"""Tests of semantic checks for scenarios with expected failures."""

import re
from pathlib import Path

import pytest

from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.goals import expects_failure
from simscen.loading.scenario import load_scenario

SCENARIO = """
simscen: 1
world:
  simscen: 1
  walls: [{{points: [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0]]}}]
  obstacles: [{{name: crate, box: [2, 2, 1], pose: {{x: 4, y: 4}}}}]
robot: {{pose: {{x: {start}, y: {start}}}}}
goals:
  - {{name: crate, pose: {{x: 4, y: 4}}}}
  - {{name: free, pose: {{x: 2, y: 1}}}}
{events}
pass: [{criteria}]
"""
IN_THE_CRATE = ['goal `crate` (4, 4) is inside obstacle "crate"']
AT_START = 'the robot\'s start (4, 4) is inside obstacle "crate"'


def messages_of(tmp_path: Path, criteria: str, start: float = 1, events: str = "") -> list[str]:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO.format(criteria=criteria, start=start, events=events))
    return [problem.message for problem in check_in_world(load_scenario(file, tmp_path))]


@pytest.mark.parametrize(
    "criterion",
    [
        "result: {status: FAILED}",
        "result: {status: FAILED, error_code: GOAL_OCCUPIED}",
        "error_code: {code: GOAL_OCCUPIED}",
        "error_code: {code: 206, goal: crate}",
        "error_code: {code: NO_VALID_PATH}",
        "error_code: {code: NO_VALID_PATH, goal: crate}",
        "error_code: {code: GOAL_OUTSIDE_MAP}",
        "error_code: {code: FAILED_TO_MAKE_PROGRESS, goal: crate}",
    ],
)
def test_goal_that_is_expected_to_fail_may_be_occupied(tmp_path, criterion):
    assert messages_of(tmp_path, f"{{{criterion}}}") == []


@pytest.mark.parametrize(
    "criterion",
    [
        "goals_reached: {}",
        "result: {status: SUCCEEDED}",
        "result: {status: CANCELED}",
        "error_code: {code: NONE}",
        "error_code: {code: NONE, goal: crate}",
        "error_code: {code: GOAL_OCCUPIED, goal: free}",
        "error_code: {code: GOAL_OCCUPIED}, severity: warn}, {collisions: {}",
    ],
)
def test_goal_that_is_not_expected_to_fail_must_be_free(tmp_path, criterion):
    canceled = "events: [{when: {time: 1}, do: {cancel_goal: {}}}]" if "CANCELED" in criterion else ""
    assert messages_of(tmp_path, f"{{{criterion}}}", events=canceled) == IN_THE_CRATE


@pytest.mark.parametrize("code", ["START_OCCUPIED", "START_OUTSIDE_MAP"])
def test_a_bad_start_may_be_asked_for_by_its_code_alone(tmp_path, code):
    assert messages_of(tmp_path, f"{{error_code: {{code: {code}}}}}", start=4) == []
    assert messages_of(tmp_path, f"{{result: {{status: FAILED, error_code: {code}}}}}", start=4) == []
    assert messages_of(tmp_path, "{error_code: {code: GOAL_OCCUPIED}}", start=4) == [AT_START]


@pytest.mark.parametrize("do", ["{{new_goal: {}}}", "[{{cancel_goal: {{}}}}, {{new_goal: {}}}]"])
def test_goals_of_events_are_checked(tmp_path, do):
    sent = do.format("{name: detour, pose: {x: 4, y: 4}}")
    events = f"events: [{{when: {{time: 1}}, do: {sent}}}]"
    assert messages_of(tmp_path, "{error_code: {code: NO_VALID_PATH, goal: crate}}", events=events) == [
        'goal `detour` (4, 4) is inside obstacle "crate"'
    ]
    assert messages_of(tmp_path, "{error_code: {code: NO_VALID_PATH}}", events=events) == []


@pytest.mark.parametrize(("x", "code"), [(4, "GOAL_OCCUPIED"), (40, "GOAL_OUTSIDE_MAP")])
def test_message_names_the_error_code_that_can_be_expected(tmp_path, x, code):
    file = tmp_path / "a.scenario.yaml"
    text = SCENARIO.replace("{{name: crate, pose: {{x: 4,", f"{{{{name: crate, pose: {{{{x: {x},")
    file.write_text(text.format(criteria="{goals_reached: {}}", start=1, events=""))
    (problem,) = check_in_world(load_scenario(file, tmp_path))
    assert f"error_code: {code}}}" in (problem.hint or "")


def test_hint_for_a_goal_in_an_obstacle_makes_the_scenario_valid(tmp_path):
    file = tmp_path / "a.scenario.yaml"
    text = SCENARIO.format(criteria="goals_reached: {}", start=1, events="on_goal_failure: continue")
    file.write_text(text)
    (problem,) = check_in_world(load_scenario(file, tmp_path))
    (key,) = re.findall(r"`(expect: .*)`", problem.hint)
    file.write_text(text.replace("x: 4, y: 4}}\n", f"x: 4, y: 4}}, {key}}}\n"))
    assert check_in_world(load_scenario(file, tmp_path)) == []


def test_hint_for_a_new_goal_in_an_obstacle_makes_the_scenario_valid(tmp_path):
    file = tmp_path / "a.scenario.yaml"
    event = "events: [{when: {time: 1}, do: {new_goal: {name: detour, pose: {x: 5, y: 4}}}}]"
    text = SCENARIO.format(criteria="goals_reached: {}", start=1, events=event)
    file.write_text(text.replace("  - {name: crate, pose: {x: 4, y: 4}}\n", ""))
    (problem,) = check_in_world(load_scenario(file, tmp_path))
    (criterion,) = re.findall(r"`(result: .*)`", problem.hint)
    file.write_text(file.read_text().replace("goals_reached: {}", criterion))
    assert check_in_world(load_scenario(file, tmp_path)) == []


def test_an_error_code_of_a_goal_applies_to_the_goal_in_every_loop(tmp_path: Path) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO.format(criteria="{error_code: {code: GOAL_OCCUPIED, goal: crate}}", start=1, events=""))
    spec = load_scenario(file, tmp_path).spec
    assert [expects_failure(spec, name) for name in ("crate", "crate#2", "free", "free#2")] == [
        True,
        True,
        False,
        False,
    ]


def test_each_robot_has_its_own_picture(tmp_path: Path) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text("""
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0]]}]}
robots:
  east: {pose: {x: 1, y: 1}, goals: [{pose: {x: 20, y: 1}}]}
  west: {pose: {x: 1, y: 4}, goals: [{pose: {x: 20, y: 4}}]}
pass: [{collisions: {max: 0}}]
""")
    problems = check_in_world(load_scenario(file, tmp_path), picture_folder=tmp_path / "pictures")
    for name in ("east", "west"):
        picture = tmp_path / "pictures" / f"a_{name}.png"
        assert picture.is_file()
        hints = [problem.hint for problem in problems if str(picture) in problem.hint]
        assert len(hints) == 1
