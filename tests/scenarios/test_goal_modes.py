"""Tests of navigation modes, waits, loops, and expected failures of goals."""

from pathlib import Path

import numpy as np
import pytest

from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status
from simscen.loading.scenario import load_scenario
from simscen.run.external.build import with_external_reference
from simscen.run.preparation import PreparedScenario, prepare
from simscen.run.simulate import simulate

HEAD = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: crate, box: [0.8, 0.8, 1], pose: {x: 3, y: 2}}]
robot: {pose: {x: 1, y: 1}}
stack: {localizer: {type: ground_truth}}
"""
PASS = "pass: [{goals_reached: {}}, {no_false_success: {}}, {path_length: {max_ratio: 1.3}}]\n"
POSES = {"east": (4.8, 1.0), "north": (4.8, 3.0), "west": (1.0, 3.0), "home": (1.0, 1.0)}
THROUGH = """\
navigation: {mode: navigate_through_poses}
goals:
  - {name: east, pose: {x: 4.8, y: 1, yaw: 3}}
  - {name: north, pose: {x: 4.8, y: 3}, xy_tolerance: 0.3}
  - {name: west, pose: {x: 1, y: 3}}
  - {name: home, pose: {x: 1, y: 1, yaw: -1.57}}
events: [{when: {waypoint: {count: 2}}, do: {push: {impulse: [0, 0.01]}}}]
"""
WAYPOINTS = """\
navigation: {mode: follow_waypoints, loops: 2}
goals:
  - {name: a, pose: {x: 2, y: 1}, on_reached: {wait: 0.5 s}}
  - {name: b, pose: {x: 1, y: 1, yaw: 3.14}, on_reached: {wait: 1 s}}
events: [{when: {goal: {name: a#2, status: reached}}, do: {push: {impulse: [0, 0.01]}}}]
"""
MISSED = """\
on_goal_failure: continue
goals:
  - {name: a, pose: {x: 1.8, y: 1}}
  - {name: in the crate, pose: {x: 3, y: 2}, expect: %s}
  - {name: b, pose: {x: 4, y: 1}}
"""


def scenario(text: str, folder: Path) -> PreparedScenario:
    file = folder / "own.scenario.yaml"
    file.write_text(HEAD + text + ("" if "pass:" in text else PASS))
    return prepare(load_scenario(file, folder))


@pytest.fixture(scope="module")
def through(tmp_path_factory):
    """Return the finished run of THROUGH."""
    return simulate(scenario(THROUGH, tmp_path_factory.mktemp("through")))


def test_one_plan_contains_all_via_poses(through):
    trace = through.trace
    (first, *_) = trace.plans
    for x, y in POSES.values():
        assert np.hypot(first.points[:, 0] - x, first.points[:, 1] - y).min() < 0.06
    assert trace.of_kind(EventKind.PLAN_MADE)[0].data["reason"] == "goal"
    assert np.hypot(*np.diff(first.points[:, :2], axis=0).T).max() < 0.1  # legs are joined without a gap


def test_poses_are_passed_within_their_radius_and_without_a_stop(through):
    trace = through.trace
    passed = {event.name: event.tick for event in trace.of_kind(EventKind.GOAL_PASSED)}
    assert list(passed) == ["east", "north", "west"]
    for name, radius in {"east": 0.7, "north": 0.3, "west": 0.7}.items():
        x, y = trace.place(passed[name])
        assert np.hypot(x - POSES[name][0], y - POSES[name][1]) <= radius
    speed = np.hypot(*trace.velocity.values[:, :2].T)
    turning = abs(trace.velocity.values[:, 2])
    assert all(speed[trace.velocity.ticks == tick][0] > 0.1 for tick in passed.values())
    driving = (trace.velocity.ticks > 240) & (trace.velocity.ticks < trace.end - 960)
    assert ((speed > 0.02) | (turning > 0.1))[driving].all()
    (ended,) = trace.of_kind(EventKind.NAVIGATION_ENDED)
    assert ended.name == "SUCCEEDED"


def test_via_pose_is_judged_by_the_minimum_distance_of_the_robot(through):
    assert through.result.outcome is Outcome.PASSED
    (reached,) = (verdict for verdict in through.result.verdicts if verdict.criterion == "goals_reached")
    truth = through.trace.truth.values
    for finding in reached.findings:
        name = finding.what.removeprefix("goal ")
        if name in ("east", "north", "west"):
            distance = np.hypot(truth[:, 0] - POSES[name][0], truth[:, 1] - POSES[name][1]).min()
            assert finding.value == pytest.approx(distance)
            assert finding.margin == pytest.approx((0.3 if name == "north" else 0.7) + 0.15 - distance)
    assert [finding.what for finding in reached.findings][-1] == "goal home heading"


def test_trigger_counts_passed_via_poses(through):
    (event_start,) = through.trace.of_kind(EventKind.EVENT_STARTED)
    second = through.trace.of_kind(EventKind.GOAL_PASSED)[1].tick
    assert second < event_start.tick <= second + 12


def test_robot_waits_at_waypoints_and_repeats_the_loop(tmp_path):
    run = simulate(scenario(WAYPOINTS + PASS, tmp_path))
    trace = run.trace
    assert run.result.outcome is Outcome.PASSED
    reached = {event.name: event.tick for event in trace.of_kind(EventKind.GOAL_REACHED)}
    accepted = {event.name: event.tick for event in trace.of_kind(EventKind.GOAL_ACCEPTED)}
    assert list(reached) == ["a", "b", "a#2", "b#2"]
    assert accepted["b"] - reached["a"] == 120
    assert accepted["a#2"] - reached["b"] == 240
    (ended,) = trace.of_kind(EventKind.NAVIGATION_ENDED)
    assert ended.tick - reached["b#2"] == 240
    waiting = [(trace.command.ticks >= reached["a"]) & (trace.command.ticks < accepted["b"])]
    assert not trace.command.values[waiting[0]].any()
    (event_start,) = trace.of_kind(EventKind.EVENT_STARTED)
    assert reached["a#2"] < event_start.tick <= reached["a#2"] + 12
    waits = [f for v in run.result.verdicts for f in v.findings if f.what.endswith(" wait")]
    assert [(f.what, f.value, f.margin) for f in waits] == [
        ("goal a wait", 0.5, 0.0),
        ("goal b wait", 1.0, 0.0),
        ("goal a#2 wait", 0.5, 0.0),
    ]


@pytest.mark.parametrize(
    ("expected", "passes"),
    [("failed", True), ("{error_code: GOAL_OCCUPIED}", True), ("{error_code: NO_VALID_PATH}", False)],
)
def test_only_the_expected_failure_passes(tmp_path, expected, passes):
    result = simulate(scenario(MISSED % expected, tmp_path)).result
    assert (result.outcome is Outcome.PASSED) is passes
    failing = [f for verdict in result.verdicts for f in verdict.findings if f.status is not Status.PASS]
    assert [f.what for f in failing] == ([] if passes else ["goal in the crate"])


def test_unexpected_success_fails(tmp_path):
    result = simulate(
        scenario("goals: [{name: a, pose: {x: 2, y: 1}, expect: failed}]\npass: [{goals_reached: {}}]\n", tmp_path)
    ).result
    assert result.outcome is Outcome.FAILED
    assert [(f.what, f.measured, f.limit) for f in result.verdicts[0].findings] == [("goal a", "reached", "failed")]


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize("text", [THROUGH, WAYPOINTS, MISSED % "failed"], ids=["through", "waypoints", "missed"])
def test_stack_protocol_gives_the_same_result_for_all_goal_modes(tmp_path, text):
    prepared = scenario(text, tmp_path)
    external = simulate(with_external_reference(prepared), stack_log=tmp_path / "stack.log")
    in_process = simulate(prepared)
    assert (external.result, external.trace.events) == (in_process.result, in_process.trace.events)


def test_preemption_drops_all_poses_of_a_drive(tmp_path):
    text = THROUGH.split("events:", maxsplit=1)[0] + (
        "events: [{when: {goal: {status: passed}}, do: {new_goal: {name: now, pose: {x: 4.8, y: 2}}}}]\n"
        "pass: [{goals_reached: {}}, {result: {status: SUCCEEDED}}, {no_false_success: {}}]\n"
    )
    run = simulate(scenario(text, tmp_path))
    assert run.result.outcome is Outcome.PASSED
    events = [
        (event.kind.value, event.name) for event in run.trace.of_kind(EventKind.GOAL_CANCELED, EventKind.GOAL_REACHED)
    ]
    assert events == [*(("goal.canceled", name) for name in ("north", "west", "home")), ("goal.reached", "now")]
