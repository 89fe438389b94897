"""Tests of checks for disturbances that are not required, and of disturbances that can happen after all."""

from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.checks.scene_runner import check_in_world
from tests.scenario_files import try_scenario

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]}]
  doors: [{name: gate, points: [[5, 0.5], [5, 1.5]]}]
  regions: {hall: [[7, 1], [9, 1], [9, 3]], outside: [[20, 20], [21, 20], [21, 21]]}
robot: {pose: {x: 2, y: 3}}
goals: [{pose: {x: 5, y: 3}}]
pass: [{goals_reached: {}}]
stack: {localizer: {type: ground_truth}}
"""


def text(tmp_path: Path, more: str, code: str) -> list[Problem]:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO + more)
    found = try_scenario(file, tmp_path)
    problems = found if isinstance(found, list) else [*found.notes, *check_in_world(found)]
    return [problem for problem in problems if problem.code == code]


@pytest.mark.parametrize(
    "event",
    [
        "{when: {robot_in: {region: outside}}, do: {mark: {name: m}}",
        "{when: {time: 1}, do: {speed_zone: {region: hall}}",
        "{when: {time: 1}, do: [{pedestrian: {name: p, pose: {x: 8, y: 5}}}, {stop: {name: p, for: 1}}]",
        "{name: a, when: {time: 1}, then: [{when: {event: {name: a}}}]",
    ],
)
@pytest.mark.parametrize(("required", "severity"), [("true", "error"), ("false", "warning")])
def test_an_impossible_event_is_an_error_only_if_it_is_required(
    tmp_path: Path, event: str, required: str, severity: str
) -> None:
    problems = text(tmp_path, f"events: [{event}, required: {required}}}]\n", "SC050")
    assert [problem.severity for problem in problems] == [severity]


@pytest.mark.parametrize(
    "more",
    [
        "faults: [{sensor: localizer, jump: {x: 2}}]\nevents: [{EVENT}]\n",
        "events: [{when: {time: 1}, do: {kidnap: {pose: {x: 8, y: 5}}}}, {EVENT}]\n",
    ],
)
def test_a_displaced_robot_or_estimate_has_an_error_with_the_true_pose_too(tmp_path: Path, more: str) -> None:
    event = "when: {localization_error: 1 m}, do: {mark: {name: lost}}"
    assert text(tmp_path, f"events: [{{{event}}}]\n", "SC050")
    assert not text(tmp_path, more.replace("EVENT", event), "SC050")


@pytest.mark.parametrize("condition", ["speed_above: 5 m/s", "turning_above: 20 rad/s", "travelled: 1 km"])
def test_an_object_that_appears_can_push_the_robot_beyond_its_limits(tmp_path: Path, condition: str) -> None:
    event = f"{{when: {{{condition}}}, do: {{mark: {{name: fast}}}}}}"
    spawn = "{when: {time: 1}, do: {spawn: {name: box, box: [1, 1, 1], pose: {x: 2.4, y: 3}}}}"
    assert text(tmp_path, f"events: [{event}]\n", "SC050")
    assert not text(tmp_path, f"events: [{spawn}, {event}]\n", "SC050")


@pytest.mark.parametrize(
    ("earlier", "count"),
    [
        ("mark: {name: gate}", 1),
        ("open: {name: gate}", 2),
        ("open: {name: gate, to: 30 %}", 0),
        ("close: {name: gate}", 0),
        ("teleport: {name: gate, pose: {x: 8, y: 5}}", 0),
    ],
)
def test_a_door_that_is_open_from_the_start_can_be_opened_after_it_was_moved(
    tmp_path: Path, earlier: str, count: int
) -> None:
    events = (
        f"events: [{{when: {{time: 1}}, do: {{{earlier}}}}}, {{when: {{time: 9}}, do: {{open: {{name: gate}}}}}}]\n"
    )
    assert len(text(tmp_path, events, "SC055")) == count
