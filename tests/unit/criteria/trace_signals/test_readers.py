"""Tests of named signals against closed forms."""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from signal_values import signal, value_at

from simscen.core.records.trace import Samples, Trace
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.trace_signals.catalog import SIGNALS, SignalName, read_signal
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def test_signal_names_and_readers_correspond():
    assert tuple(SIGNALS) == get_args(SignalName)


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_has_one_finite_value_for_each_truth_sample_within_its_range(name):
    words = {
        "seconds": 4,
        "truth": [[0, 0, 0], [4, 2, 1, 1]],
        "plans": [[1, [[0, 0], [2, 1]]]],
        "objects": {"cart": [[0, 3, 3]]},
        "events": [
            [0.5, "goal.accepted", "shelf"],
            [1, "plan.made", "", {"reason": "goal"}],
            [1, "fault.started", "off"],
            [1, "event.started", "off"],
            [0, "object.spawned", "cart", {"person": True, "size": [0.25, 1.7]}],
        ],
    }
    case = {"goals": [{"name": "shelf", "pose": [2, 1, 0]}], "regions": {"dock": [[0, 0], [1, 0], [1, 1]]}}
    of = {"object": "cart", "region": "dock", "fault": "off", "event": "off"}
    wanted = {key: of[key] for key in SIGNALS[name].alternative_arguments[:1]}
    values = read_signal(name, synthetic_trace(words), synthetic_case(case), wanted)
    assert values.shape == (161,)
    assert np.isfinite(values).all()
    assert values.min() >= SIGNALS[name].minimum
    assert values.max() <= SIGNALS[name].maximum


def test_uncertainty_is_unknown_without_a_covariance():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    bare = replace(trace, belief=Samples(trace.belief.ticks, trace.belief.values[:, :3]))
    for name in ("position_std", "yaw_std"):
        with pytest.raises(MissingEvidence, match="no covariance of the belief was recorded"):
            read_signal(name, bare, synthetic_case({}), {})


def test_kidnapping_does_not_count_as_distance_driven():
    events = [[2, "robot.placed"]]
    truth = [[0, 0, 0], [2, 1, 0], [2.025, 9, 0], [4, 10, 0]]
    values = signal("travelled", {"seconds": 4, "truth": truth, "events": events})
    assert values[0] == 0.0
    assert values[-1] == pytest.approx(2.0, abs=0.02)


def test_goal_is_the_last_accepted_one_also_from_an_event():
    words = {
        "seconds": 6,
        "truth": [[0, 1, -2, 3.0]],
        "events": [[1, "goal.accepted", "shelf"], [3, "goal.accepted", "sent", {"x": 1.0, "y": 5.0, "yaw": -3.0}]],
    }
    case = {"goals": [{"name": "shelf", "pose": [4, 2, 3.1]}]}
    distance, heading = signal("goal_distance", words, case), signal("goal_heading_error", words, case)
    assert [value_at(distance, t) for t in (0, 1, 2.975, 3, 6)] == [5.0, 5.0, 5.0, 7.0, 7.0]
    assert [value_at(heading, t) for t in (0, 3)] == pytest.approx([0.1, 2 * math.pi - 6.0])


def test_goal_pose_comes_from_its_name_unless_its_acceptance_has_a_pose():
    words = {"seconds": 2, "truth": [[0, 0, 0]], "events": [[1, "goal.accepted", "shelf", {"x": 1.0, "y": 0.0}]]}
    case = {"goals": [{"name": "first", "pose": [0, 2, 0]}, {"name": "shelf", "pose": [3, 4, 0]}]}
    assert set(signal("goal_distance", words, case)) == {5.0}


def test_unfinished_state_lasts_to_the_last_sample():
    words = {"seconds": 2, "truth": [[0, 0, 0]], "events": [[1, "goal.accepted", "a"], [1, "collision.started", "b"]]}
    for name in ("goal_active", "in_collision"):
        assert np.flatnonzero(signal(name, words)).tolist() == list(range(40, 81))


def test_the_first_goal_counts_before_any_is_accepted_and_without_goals_there_is_no_distance():
    words = {"seconds": 1, "truth": [[0, 0, 0]]}
    goals = [{"name": "a", "pose": [3, 4, 0]}, {"name": "b", "pose": [1, 0, 0]}]
    assert signal("goal_distance", words, {"goals": goals})[0] == 5.0
    with pytest.raises(MissingEvidence, match="no goal"):
        signal("goal_distance", words)


def test_scan_age_counts_from_the_start_and_from_the_newest_scan():
    age = signal("scan_age", {"seconds": 4, "truth": [[0, 0, 0]], "scans": [[1, 2]]})
    assert [value_at(age, t) for t in (0, 0.5, 1.0, 1.05, 2.0, 4.0)] == pytest.approx([0, 0.5, 0, 0.05, 0, 2.0])


def test_scan_age_without_scans_is_the_time_of_the_run():
    age = signal("scan_age", {"seconds": 4, "truth": [[0, 0, 0]], "scans": []})
    assert [value_at(age, t) for t in (0, 0.5, 4.0)] == [0, 0.5, 4.0]


def test_belief_error_is_held_until_the_next_belief():
    words = {"seconds": 2, "truth": [[0, 0, 0], [2, 2, 0]], "belief": {"offset": [0.3, 0.4, -0.2]}}
    assert signal("localization_error", words) == pytest.approx([0.5] * 81)
    assert signal("localization_yaw_error", words) == pytest.approx([0.2] * 81)
    assert value_at(signal("belief_age", words), 0.175) == pytest.approx(0.075)


def test_position_uncertainty_is_that_of_the_worst_direction():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    turn, variances = 0.7, np.diag([0.09, 0.01])
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    (xx, xy), (_, yy) = rotation @ variances @ rotation.T
    values = trace.belief.values.copy()
    values[:, 3:9] = [xx, xy, 0.0, yy, 0.0, 0.04]
    trace = replace(trace, belief=Samples(trace.belief.ticks, values))
    assert read_signal("position_std", trace, synthetic_case({}), {})[0] == pytest.approx(0.3)
    assert read_signal("yaw_std", trace, synthetic_case({}), {})[0] == pytest.approx(0.2)


@pytest.mark.parametrize(("std", "known"), [(0.5, 1.0), (0.51, 0.0)])
def test_uncertain_robot_is_not_localized(std, known):
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    values = trace.belief.values.copy()
    values[:, 3] = values[:, 6] = std * std
    unsure = replace(trace, belief=Samples(trace.belief.ticks, values))
    assert set(read_signal("localized", unsure, synthetic_case({}), {})) == {known}


def test_a_robot_is_localized_from_its_first_belief_until_a_second_after_its_last():
    trace = synthetic_trace({"seconds": 6, "truth": [[0, 0, 0]]})
    some = (trace.belief.ticks >= 240) & (trace.belief.ticks <= 480)
    trace = replace(trace, belief=Samples(trace.belief.ticks[some], trace.belief.values[some]))
    values = read_signal("localized", trace, synthetic_case({}), {})
    assert [value_at(values, t) for t in (0.975, 1.0, 2.0, 3.0, 3.025)] == [0, 1, 1, 1, 0]


def test_without_a_belief_a_robot_is_not_localized_and_has_no_error():
    words = {"seconds": 1, "truth": [[0, 0, 0]], "belief": None}
    assert not signal("localized", words).any()
    for name in ("localization_error", "position_std", "nees", "distance_remaining"):
        with pytest.raises(MissingEvidence, match="recorded"):
            signal(name, words, {"goals": [{"name": "a", "pose": [1, 0, 0]}]})


def test_command_is_held_and_zero_before_the_first():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    command = Samples(np.array([120, 180]), np.array([[0.3, 0.4, -1.0], [0.0, 0.0, 0.0]]))
    trace = replace(trace, command=command)
    speed, turn = (read_signal(name, trace, synthetic_case({}), {}) for name in ("command_speed", "command_turn_rate"))
    assert [value_at(speed, t) for t in (0, 0.475, 0.5, 0.725, 0.75)] == [0, 0, 0.5, 0.5, 0]
    assert [value_at(turn, t) for t in (0.475, 0.5, 0.75)] == [0, 1, 0]


def test_fault_is_active_until_its_end_and_event_without_end_until_the_last_sample():
    events = [[1, "fault.started", "lidar.off"], [2, "fault.ended", "lidar.off"], [1.5, "event.started", "cart"]]
    words = {"seconds": 3, "truth": [[0, 0, 0]], "events": events}
    fault, event = signal("fault_active", words, fault="lidar.off"), signal("event_active", words, event="cart")
    assert [value_at(fault, t) for t in (0.975, 1, 1.975, 2)] == [0, 1, 1, 0]
    assert [value_at(event, t) for t in (1.475, 1.5, 3)] == [0, 1, 1]
    assert np.flatnonzero(signal("started", words, event="cart")).tolist() == [60]
    assert np.flatnonzero(signal("started", words, fault="lidar.off")).tolist() == [40]


def test_short_state_counts_at_the_next_sample():
    events = [[1.01, "collision.started", "box"], [1.02, "collision.ended", "box"]]
    words = {"seconds": 3, "truth": [[0, 0, 0]], "events": events}
    assert np.flatnonzero(signal("in_collision", words)).tolist() == [41]
    assert np.flatnonzero(signal("in_collision", words, **{"with": "box"})).tolist() == [41]
    assert not signal("in_collision", words, **{"with": "wall"}).any()


@pytest.mark.parametrize(
    ("name", "arguments", "known"),
    [
        ("in_collision", {}, {"objects": {"cart"}}),
        ("in_collision", {"with": "cart"}, {"objects": {"cart"}}),
        ("event_active", {"event": "rush hour"}, {"labels": {"rush hour"}}),
        ("event_active", {"event": "rush hour"}, {"labels": None}),
    ],
)
def test_signal_of_a_known_name_is_read(name, arguments, known):
    case = replace(synthetic_case({}), **known)
    assert not read_signal(name, synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), case, arguments).any()


@pytest.mark.parametrize(
    ("name", "arguments", "known"),
    [
        ("in_collision", {"with": "box"}, {"objects": {"cart"}}),
        ("event_active", {"event": "rush hour"}, {"labels": {"lunch"}}),
    ],
)
def test_signal_of_an_unknown_name_is_refused(name, arguments, known):
    case = replace(synthetic_case({}), **known)
    with pytest.raises(MissingEvidence):
        read_signal(name, synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), case, arguments)


def test_goals_that_are_accepted_at_the_same_tick_are_active_together():
    events = [[1, "goal.accepted", "a"], [1, "goal.accepted", "b"], [2, "goal.reached", "a"]]
    values = signal("goal_active", {"seconds": 3, "truth": [[0, 0, 0]], "events": events}, goal="a")
    assert [value_at(values, t) for t in (0.975, 1, 1.975, 2)] == [0, 1, 1, 0]


def test_contacts_with_two_objects_end_independently():
    events = [
        [1, "collision.started", "a"],
        [2, "collision.started", "b"],
        [2.5, "collision.ended", "b"],
        [3, "collision.ended", "a"],
    ]
    words = {"seconds": 4, "truth": [[0, 0, 0]], "events": events}
    values = signal("in_collision", words)
    assert [value_at(values, t) for t in (0.975, 1, 2.7, 2.975, 3)] == [0, 1, 1, 1, 0]
    assert [value_at(signal("collision_count", words), t) for t in (0.975, 1, 2)] == [0, 1, 2]


def test_goal_is_active_until_it_ends_or_is_replaced():
    events = [
        [1, "goal.accepted", "a"],
        [2, "goal.accepted", "b"],
        [3, "goal.reached", "b"],
        [3.5, "recovery.started", "spin"],
        [3.75, "recovery.ended", "spin"],
        [3.8, "plan.made", "", {"reason": "blocked"}],
        [3.8, "plan.made", "", {"reason": "goal"}],
        [3.9, "plan.made", "", {"reason": "rate"}],
    ]
    words = {"seconds": 4, "truth": [[0, 0, 0]], "events": events}
    first, some = signal("goal_active", words, goal="a"), signal("goal_active", words)
    assert [value_at(first, t) for t in (0.975, 1, 1.975, 2)] == [0, 1, 1, 0]
    assert [value_at(some, t) for t in (0.975, 1, 2, 2.975, 3)] == [0, 1, 1, 1, 0]
    assert np.flatnonzero(signal("recovery_active", words, recovery="spin")).tolist() == list(range(140, 150))
    assert not signal("recovery_active", words, recovery="wait").any()
    assert (signal("replan_count", words)[-1], signal("recovery_count", words)[-1]) == (2, 1)
    assert value_at(signal("time", words), 3.5) == 3.5


def test_error_of_a_nonfinite_signal_has_its_name_and_time():
    truth = [[0, 0, 0], [2, math.nan, 0], [4, 0, 0]]
    with pytest.raises(InvalidTrace, match=r"the true pose is not finite at t = 0.03 s"):
        signal("travelled", {"seconds": 4, "truth": truth})


@pytest.mark.parametrize("name", ["clearance", "speed", "time", "goal_distance", "scan_age"])
def test_signals_need_the_truth_for_their_clock(name):
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    nothing = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    blind: Trace = replace(trace, truth=nothing)
    with pytest.raises(MissingEvidence, match="true pose"):
        read_signal(name, blind, synthetic_case({"goals": [{"name": "a", "pose": [1, 0, 0]}]}), {})


def test_events_are_counted_in_any_order():
    events = [[1, "recovery.started", "spin"], [2, "recovery.started", "wait"], [3, "recovery.started", "spin"]]
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0]], "events": events})
    values = read_signal("recovery_count", replace(trace, events=trace.events[::-1]), synthetic_case({}), {})
    assert [value_at(values, t) for t in (0, 1, 2, 3, 4)] == [0, 1, 2, 3, 3]


def test_a_goal_matches_its_name_in_each_loop_and_other_names_match_exactly():
    events = [[1, "goal.accepted", "shelf#2"], [2, "goal.reached", "shelf#2"], [3, "recovery.started", "spin#2"]]
    words = {"seconds": 4, "truth": [[0, 0, 0]], "events": events}
    assert [value_at(signal("goal_active", words, goal=name), 1.5) for name in ("shelf", "shelf#2", "shelf#1")] == [
        1,
        1,
        0,
    ]
    assert signal("recovery_active", words, recovery="spin#2").any()
    assert not signal("recovery_active", words, recovery="spin").any()


@pytest.mark.parametrize(
    ("name", "start", "end"),
    [
        ("goal_active", "goal.accepted", "goal.failed"),
        ("in_collision", "collision.started", "collision.ended"),
        ("recovery_active", "recovery.started", "recovery.ended"),
    ],
)
def test_a_state_that_ends_at_the_tick_of_its_start_counts_at_one_sample(name, start, end):
    words = {"seconds": 4, "truth": [[0, 0, 0]], "events": [[1, start, "shelf"], [1, end, "shelf"]]}
    assert np.flatnonzero(signal(name, words)).tolist() == [40]
