"""Tests of metrics at the limits of single samples."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.criteria.trace_signals.sparc_ldlj import sparc
from simscen.judge.metrics.compute import NO_GOALS, barn_score, compute_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

NAMES = "abc"
GOALS = {
    "goals": [{"name": name, "pose": [k, 0, 0]} for k, name in enumerate(NAMES, start=1)],
    "shortest": dict.fromkeys(NAMES, 1.0),
}
TOUR = {"seconds": 12, "truth": [[0, 0, 0], [2, 1, 0], [3, 1, 0], [4, 2, 0], [5, 2, 0], [9, 3, 0], [12, 3, 0]]}
EVENTS = [
    [1, "goal.accepted", "a"],
    [2, "goal.reached", "a"],
    [3, "goal.accepted", "b"],
    [4, "goal.reached", "b"],
    [5, "goal.accepted", "c"],
    [9, "goal.reached", "c"],
]


def measures(events=(), case=GOALS, **trace_keys):
    return compute_metrics(synthetic_trace({**TOUR, "events": list(events), **trace_keys}), synthetic_case(case))


def test_time_to_goal_is_from_first_acceptance_to_last_arrival():
    found = measures(EVENTS).values
    assert (found["time_to_goal"], found["success"]) == (8.0, 1.0)
    assert measures([EVENTS[0], *EVENTS[2:]]).values["time_to_goal"] == 8.0
    assert measures([*EVENTS[:3], *EVENTS[4:]]).values["time_to_goal"] == 8.0


@pytest.mark.parametrize("events", [[], EVENTS[:5], EVENTS[:2]])
def test_time_to_goal_needs_the_last_arrival(events):
    found = measures(events)
    assert found.values["time_to_goal"] is None
    assert found.undefined["time_to_goal"] == "the last goal was not reached"
    assert measures([*EVENTS], case={}).values["time_to_goal"] is None


@pytest.mark.parametrize("events", [EVENTS[1::2], EVENTS[1:]])
def test_time_to_goal_needs_the_first_acceptance(events):
    """Logs of real robots can begin during a drive."""
    found = measures(events)
    assert found.values["time_to_goal"] is None
    assert found.undefined["time_to_goal"] == "the acceptance of the first goal was not recorded"


def test_time_to_goal_begins_after_a_rejected_goal():
    rejected = [1, "goal.failed", "a", {"error_code": 206}]
    found = measures([rejected, *EVENTS[2:]], case={**GOALS, "expected": {"a": "failed"}})
    assert found.values["time_to_goal"] == 6.0


def test_robot_without_goals_has_no_success():
    found = measures(case={})
    assert found.values["success"] is None
    assert found.undefined["success"] == NO_GOALS


def test_reaching_some_of_several_goals_is_no_success():
    assert measures(EVENTS[:4]).values["success"] == 0.0


def test_preempted_goal_is_not_required():
    case = {**GOALS, "sent": [{"name": "d", "pose": [3, 0, 0]}]}
    last = [[9, "goal.canceled", "c", {"preempted_by": "d"}], [9, "goal.accepted", "d"], [11, "goal.reached", "d"]]
    assert measures([*EVENTS[:5], *last], case).values["time_to_goal"] == 10.0
    dropped = [[7, "goal.accepted", "c"], [7, "goal.canceled", "c", {"preempted_by": "d"}]]
    before = [*EVENTS[:3], [5, "goal.accepted", "d"], [6, "goal.reached", "d"]]
    assert measures([*before, *dropped], case).values["time_to_goal"] == 5.0


def test_soft_spl_is_computed_from_the_last_goal_and_final_position():
    found = measures(truth=[[0, 0, 0], [11.975, 0, 0], [12, 1.5, 0]])
    assert found.values["soft_spl"] == pytest.approx(0.5)


def test_soft_spl_needs_the_true_pose():
    nothing = Samples(np.empty(0, np.int64), np.empty((0, 3)))
    found = compute_metrics(replace(synthetic_trace(TOUR), truth=nothing, velocity=nothing), synthetic_case(GOALS))
    assert found.undefined["soft_spl"] == "the true pose was not recorded"
    assert found.undefined["max_speed"] == found.undefined["sparc"] == "the true velocity was not recorded"


def test_plans_for_new_goals_are_not_replans():
    plans = [[k, "plan.made", "", {"reason": reason}] for k, reason in enumerate(("goal", "timer", "blocked", "worse"))]
    assert measures(plans).values["replans"] == 3.0
    assert measures([*plans, [4, "plan.made", "", {}]]).values["replans"] is None  # its reason is unknown


def test_paths_of_half_a_meter_have_a_score():
    assert barn_score(True, 1.0, 0.5) == pytest.approx(0.25)


def metrics_of_speeds(speeds, ticks=None):
    trace = synthetic_trace({"seconds": (len(speeds) - 1) / 40, "truth": [[0, 0, 0]]})
    values = np.column_stack((speeds, np.zeros((len(speeds), 2))))
    velocity = Samples(trace.truth.ticks if ticks is None else ticks, values)
    return compute_metrics(replace(trace, velocity=velocity), synthetic_case({}))


def test_a_centimeter_a_second_is_motion():
    assert metrics_of_speeds(np.full(81, 0.01)).values["sparc"] < 0
    assert metrics_of_speeds(np.full(81, 0.0099)).undefined["sparc"] == "the robot never moved"


def test_smoothness_needs_at_least_two_samples():
    assert metrics_of_speeds(np.array([1.0, 0.5])).values["sparc"] == sparc(np.array([1.0, 0.5]), 40.0)
    metrics = metrics_of_speeds(np.array([1.0]))
    assert metrics.undefined["sparc"] == metrics.undefined["ldlj"] == "the run is too short: 1 sample of the truth"


def test_smoothness_uses_the_sampling_rate_not_the_start_time():
    speeds = np.array([1.0, *np.tile([0.5, 1.0], 20)])  # of 20 Hz, which is noise at this rate and no other
    assert sparc(speeds, 40.0) != sparc(speeds, 0.2)
    assert metrics_of_speeds(speeds, 600 + 6 * np.arange(41)).values["sparc"] == sparc(speeds, 40.0)


def contact(at, kind):
    return [at, f"collision.{kind}", "wall"]


@pytest.mark.parametrize(
    ("events", "collisions", "seconds"),
    [
        ([], 0, 0.0),
        ([contact(1, "started"), contact(3, "ended"), contact(5, "started"), contact(6, "ended")], 2, 3.0),
        ([contact(1, "started"), contact(2, "started"), contact(3, "ended"), contact(7, "ended")], 2, 6.0),
        ([contact(1, "ended"), contact(2, "started"), contact(5, "ended")], 1, 3.0),
        ([contact(1, "ended"), contact(2, "ended"), contact(3, "started")], 1, 9.0),
    ],
)
def test_contact_time_is_the_union_of_contacts(events, collisions, seconds):
    found = measures(events).values
    assert (found["collisions"], found["contact_time"]) == (collisions, seconds)
