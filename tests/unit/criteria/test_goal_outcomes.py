"""Tests of the reports that belong to a goal, and of the closest approach to a via pose."""

import pytest

from simscen.core.records.events import EventKind
from simscen.criteria.goal_outcomes import GoalOutcome, closest_approach, goal_outcomes
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def goal(name, x=0.0, via=False):
    return {"name": name, "pose": [x, 0, 0], "via": via}


def outcomes(goals, events):
    """Return the trace of a robot at x = t and y = 0, and the outcomes of the goals."""
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0], [10, 10, 0]], "events": events})
    return trace, goal_outcomes(trace, synthetic_case({"goals": goals}))


def test_kth_goal_of_a_name_has_the_kth_report_of_that_name():
    events = [[t, kind, "dock"] for t in (1, 3, 5) for kind in ("goal.accepted", "goal.reached")]
    events = [[t + (0.5 if kind == "goal.reached" else 0), kind, name] for t, kind, name in events]
    trace, all_outcomes = outcomes([goal("dock", 1.0), goal("dock", 2.0), goal("dock", 3.0)], events)
    assert [(outcome.goal.pose.x, trace.seconds(outcome.reached_tick)) for outcome in all_outcomes] == [
        (1, 1.5),
        (2, 3.5),
        (3, 5.5),
    ]


def test_via_pose_without_reports_has_the_outcome_of_the_next_stop():
    """The stop before the via pose is reached, and the stop after it fails."""
    events = [
        [0, "goal.accepted", "first"],
        [2, "goal.reached", "first"],
        [2, "goal.accepted", "last"],
        [6, "goal.failed", "last", {"error_name": "TF_ERROR"}],
    ]
    _, all_outcomes = outcomes([goal("first"), goal("between", via=True), goal("last")], events)
    via = next(outcome for outcome in all_outcomes if outcome.goal.name == "between")
    assert via.end.kind == EventKind.GOAL_FAILED
    assert via.end.name == "between"


@pytest.mark.parametrize("via_x", [0.0, 2.0, 7.0, 8.0, 10.0])
def test_closest_approach_is_within_the_drive(via_x):
    """The robot is at x = t; the drive lasts from 2 s to 8 s, both included."""
    events = [
        [2, "goal.accepted", "via"],
        [3, "goal.passed", "via"],
        [3, "goal.accepted", "stop"],
        [8, "goal.reached", "stop"],
    ]
    trace, all_outcomes = outcomes([goal("via", via_x, via=True), goal("stop", 9)], events)
    via = next(outcome for outcome in all_outcomes if outcome.goal.name == "via")
    tick, distance = closest_approach(trace, via, all_outcomes)
    closest_x = min(max(via_x, 2.0), 8.0)
    assert trace.seconds(tick) == pytest.approx(closest_x)
    assert distance == pytest.approx(abs(via_x - closest_x))


@pytest.mark.parametrize("stops", [[], [goal("stop", 9)]])
def test_closest_approach_of_an_unfinished_drive_is_within_the_run(stops):
    trace, all_outcomes = outcomes([goal("via", 12.0, via=True), *stops], [[1, "goal.accepted", "via"]])
    via = next(outcome for outcome in all_outcomes if outcome.goal.name == "via")
    assert closest_approach(trace, via, all_outcomes) == (trace.end, pytest.approx(2.0))


def test_closest_approach_of_a_pose_that_was_never_accepted_is_searched_in_the_whole_run():
    trace, all_outcomes = outcomes([goal("via", -1.0, via=True)], [])
    assert closest_approach(trace, GoalOutcome(all_outcomes[0].goal, None, None), [*all_outcomes]) == (
        0,
        pytest.approx(1.0),
    )
