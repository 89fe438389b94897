"""Tests of collisions in logs with incomplete data."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria import collisions
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.trace_signals.ground_truth import speed
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CONTACT = [[4.5, "collision.started", "cart", {"x": 1.0, "impulse": 2.0}]]
NO_SAMPLES = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))


def verdict(keys, trace):
    (collision_verdict,) = judge([AnyCriterion.model_validate({"collisions": keys})], trace, synthetic_case({}))
    return collision_verdict


def with_sparse_velocity(trace, period_s):
    """Return the trace with one velocity sample per period."""
    is_kept = trace.velocity.ticks % (240 * period_s) == 0
    return replace(trace, velocity=Samples(trace.velocity.ticks[is_kept], trace.velocity.values[is_kept]))


@pytest.mark.parametrize(("stop_s", "status"), [(5.0, Status.FAIL), (3.0, Status.PASS)])
def test_newest_sample_before_contact_determines_the_fault(stop_s, status):
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0], [stop_s, 2, 0], [8, 2, 0]], "events": CONTACT})
    assert verdict({"caused_by_robot": True}, with_sparse_velocity(trace, 1)).status is status


def test_velocities_are_read_once_for_many_contacts(monkeypatch):
    calls = []
    monkeypatch.setattr(collisions, "speed", lambda trace: calls.append(trace) or speed(trace))
    events = [[0.01 * k, *CONTACT[0][1:]] for k in range(100)]
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0], [8, 4, 0]], "events": events})
    assert verdict({"caused_by_robot": True}, trace).status is Status.FAIL
    assert len(calls) == 1


def test_contact_before_the_first_sample_is_judged_by_that_sample():
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0], [8, 4, 0]], "events": [[0.01, *CONTACT[0][1:]]]})
    late_trace = replace(trace, velocity=Samples(trace.velocity.ticks[40:], trace.velocity.values[40:]))
    assert verdict({"caused_by_robot": True}, late_trace).status is Status.FAIL


def test_fault_of_a_collision_is_unknown_without_velocity():
    trace = replace(synthetic_trace({"seconds": 8, "truth": [[0, 0, 0]], "events": CONTACT}), velocity=NO_SAMPLES)
    assert verdict({"caused_by_robot": True}, trace).status is Status.INCONCLUSIVE
    assert verdict({}, trace).status is Status.FAIL


def test_contacts_count_without_truth_but_their_absence_is_inconclusive():
    trace = replace(synthetic_trace({"seconds": 8, "truth": [[0, 0, 0]], "events": CONTACT}), truth=NO_SAMPLES)
    assert verdict({}, trace).status is Status.FAIL
    assert verdict({}, trace).findings[0].detail == ("t = 4.50 s: touched cart, 2.0 N s",)
    assert verdict({"max": 1}, trace).status is Status.PASS
    assert verdict({}, replace(trace, events=trace.events[1:])).status is Status.INCONCLUSIVE


def test_object_without_complete_position_has_no_location():
    trace = synthetic_trace(
        {"seconds": 8, "truth": [[0, 0, 0]], "events": [[1, "collision.started", "cart", {"y": 1.0}]]}
    )
    assert verdict({}, trace).findings[0].detail == ("t = 1.00 s: touched cart",)


@pytest.mark.parametrize(("speed", "status"), [(0.1, Status.PASS), (0.10001, Status.FAIL)])
def test_robot_below_a_tenth_of_a_meter_per_second_is_standing(speed, status):
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0]], "events": CONTACT})
    trace.velocity.values[:, 0] = speed
    assert verdict({"caused_by_robot": True}, trace).status is status


def test_later_samples_do_not_decide_an_early_contact():
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0]], "events": [[0.01, *CONTACT[0][1:]]]})
    trace.velocity.values[41:, 0] = 1.0
    late_trace = replace(trace, velocity=Samples(trace.velocity.ticks[40:], trace.velocity.values[40:]))
    assert verdict({"caused_by_robot": True}, late_trace).status is Status.PASS


@pytest.mark.parametrize(("objects", "status"), [(None, Status.PASS), ({"shelf"}, Status.PASS), ({"cart"}, None)])
def test_contacts_with_an_object_that_nothing_names_are_inconclusive(objects, status):
    """The object is unknown only if the names of all objects are known."""
    trace = synthetic_trace({"seconds": 8, "truth": [[0, 0, 0], [8, 2, 0]], "events": CONTACT})
    case = replace(synthetic_case({}), objects=objects)
    (collision_verdict,) = judge([AnyCriterion.model_validate({"collisions": {"with": "shelf"}})], trace, case)
    assert collision_verdict.status is (status or Status.INCONCLUSIVE)
