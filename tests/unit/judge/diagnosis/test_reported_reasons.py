"""Tests of reasons that the stack reported about a goal, up to and including the tick of the failure."""

import pytest

from simscen.criteria.goal_outcomes import goal_outcomes
from simscen.judge.goal_failure_causes import _failed_recoveries, _reported_failure, _robot_hold
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

TICK_RATE_HZ = 240


def trace_and_outcome(*events):
    """Return a run of 10 s with these events, and the outcome of its goal `study`, accepted at 2 s."""
    accepted = [2, "goal.accepted", "study"]
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]], "events": [accepted, *events]})
    return trace, goal_outcomes(trace, synthetic_case({"goals": [{"name": "study", "pose": [9, 0, 0]}]}))[0]


ROBOT_HELD = [3, "robot.held", "collision_monitor", {"message": "scans are late"}]


@pytest.mark.parametrize(
    ("events", "at", "is_held"),
    [
        ([ROBOT_HELD], 3, True),
        ([ROBOT_HELD], 2.99, False),
        ([ROBOT_HELD, [5, "robot.released", "collision_monitor"]], 5, True),  # it had been held until then
        ([ROBOT_HELD, [5, "robot.released", "collision_monitor"]], 5.1, False),
        ([ROBOT_HELD, [5, "robot.released", "collision_monitor"], [7, *ROBOT_HELD[1:]]], 8, True),
    ],
)
def test_robot_is_held_from_the_report_until_after_its_release(events, at, is_held):
    trace, _ = trace_and_outcome(*events)
    assert bool(_robot_hold(trace, round(at * TICK_RATE_HZ))) == is_held


def test_report_of_a_failed_goal_counts_from_its_tick_on():
    trace, outcome = trace_and_outcome(
        [1, "recovery.started", "wait"],
        [2, "recovery.started", "clear"],
        [6, "recovery.started", "spin"],
        [6, "goal.failed", "study", {"message": "no valid path", "error_name": "NO_VALID_PATH"}],
        [7, "recovery.started", "backup"],
    )
    assert _reported_failure(trace, outcome, 6 * TICK_RATE_HZ - 1) == []
    assert _reported_failure(trace, outcome, 6 * TICK_RATE_HZ) == [
        "the stack gave up and reported: no valid path; clear, spin had not helped"
    ]


def test_failed_recoveries_count_from_goal_acceptance_to_failure():
    failed = {"outcome": "failed", "error_name": "COLLISION_AHEAD"}
    trace, outcome = trace_and_outcome(
        [1, "recovery.ended", "wait", failed],
        [2, "recovery.ended", "spin", failed],
        [4, "recovery.ended", "clear", {"outcome": "succeeded"}],
        [6, "recovery.ended", "backup", failed],
        [7, "recovery.ended", "retrace", failed],
    )
    assert _failed_recoveries(trace, outcome, 6 * TICK_RATE_HZ) == [
        "recoveries failed: spin with COLLISION_AHEAD, backup with COLLISION_AHEAD"
    ]
