"""Tests of the localization criteria with few beliefs, as of AMCL, which publishes only while the robot moves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.localization import LocalizationConsistency, LocalizationError, RelocalizedWithin
from simscen.criteria.temporal import Always, Eventually
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.testing.synthetic_trace import TICK_RATE_HZ, synthetic_case, synthetic_trace

CASE = synthetic_case({})
NO_BELIEF = "the robot never reported an estimated pose"


def trace_of(beliefs, seconds=60, columns=9, events=()):
    """Return the trace of a robot that stands at the origin, with beliefs (t, x) of a standard deviation of 0.1."""
    trace = synthetic_trace({"seconds": seconds, "truth": [[0, 0, 0]], "events": events})
    ticks = np.array([round(t * TICK_RATE_HZ) for t, _ in beliefs], dtype=np.int64)
    values = np.array([[x, 0, 0, 0.01, 0, 0, 0.01, 0, 0.01] for _, x in beliefs]).reshape(-1, 9)
    return replace(trace, belief=Samples(ticks, values[:, :columns]))


@pytest.mark.parametrize(("first", "status"), [(6.0, Status.PASS), (6.1, Status.INCONCLUSIVE)])
@pytest.mark.parametrize("bound", ["max", "rmse", "max_yaw"])
def test_unknown_error_at_the_start_of_the_evaluation_does_not_pass(first, status, bound):
    criterion = LocalizationError(**{bound: 0.3}, after=5.0)
    (found,) = criterion.judge(trace_of([(first, 0.0)]), CASE)
    assert found.status is status
    if status is Status.INCONCLUSIVE:
        assert found.measured == "the first belief is from t = 6.10 s, but the evaluation begins at 5.00 s"
        assert found.limit.startswith("≤ 0.30")


@pytest.mark.parametrize(("first", "status"), [(21.0, Status.PASS), (21.1, Status.INCONCLUSIVE)])
def test_evaluation_does_not_begin_before_the_first_true_pose(first, status):
    """Logs of real robots can begin before the ground truth."""
    trace = trace_of([(first, 0.0)])
    trace = replace(trace, truth=trace.truth.select(trace.truth.ticks >= 20 * TICK_RATE_HZ))
    (found,) = LocalizationError(max=0.3, after=5.0).judge(trace, CASE)
    assert found.status is status
    if status is Status.INCONCLUSIVE:
        assert found.measured == "the first belief is from t = 21.10 s, but the evaluation begins at 20.00 s"


def test_late_first_belief_can_fail_and_decides_the_final_error():
    criterion = LocalizationError(max=0.3, rmse=0.3, final=0.3)
    findings = criterion.judge(trace_of([(30, 2.0), (60, 0.0)]), CASE)
    assert [found.status for found in findings] == [Status.FAIL, Status.FAIL, Status.PASS]


@pytest.mark.parametrize(
    ("beliefs", "status", "value"),
    [
        ([(30, 3.0)], Status.FAIL, 60.0),
        ([(30, 0.0)], Status.FAIL, 30.0),
        ([(20, 0.0)], Status.INCONCLUSIVE, None),
    ],
)
def test_robot_without_a_belief_is_lost(beliefs, status, value):
    (found,) = RelocalizedWithin(time=20.0).judge(trace_of(beliefs), CASE)
    assert (found.status, found.value) == (status, value)


def test_robot_is_not_lost_while_its_correct_belief_is_recent():
    trace = trace_of([(t, 0.0) for t in np.arange(0.0, 61.0)], events=[[10.2, "event.started", "kidnapped"]])
    (found,) = RelocalizedWithin(time=0.5, after="kidnapped").judge(trace, CASE)
    assert found.measured == "the robot was never lost after kidnapped"


def test_beliefs_before_the_evaluation_do_not_count_for_consistency():
    """Beliefs before `after` are wrong and overconfident, all later ones are one standard deviation from the truth."""
    trace = trace_of([(2, 100.0), (30, 0.1), (40, 0.1)])
    (found,) = LocalizationConsistency(after=10.0).judge(trace, CASE)
    assert (found.status, found.value) == (Status.PASS, pytest.approx(1.0))
    assert "(mean of 2 NEES" in found.limit
    (found,) = LocalizationConsistency(after=50.0).judge(trace, CASE)
    assert (found.status, found.measured) == (Status.INCONCLUSIVE, "there is no belief after t = 50.00 s")


def test_no_sample_after_the_last_belief():
    """The second sample would be one tick after the last belief."""
    (found,) = LocalizationConsistency(every=1.0).judge(trace_of([(0, 0.1), (1 - 1 / TICK_RATE_HZ, 0.1)]), CASE)
    assert "(mean of 1 NEES" in found.limit


@pytest.mark.parametrize(("columns", "beliefs", "reason"), [(9, [], NO_BELIEF), (3, [(1, 0.0)], "no covariance")])
def test_consistency_is_undefined_without_beliefs_or_covariances(columns, beliefs, reason):
    (found,) = LocalizationConsistency().judge(trace_of(beliefs, columns=columns), CASE)
    assert found.status is Status.INCONCLUSIVE
    assert reason in found.measured


BELIEF_SIGNALS = ("localization_error", "localization_yaw_error", "position_std", "yaw_std", "nees")


@pytest.mark.parametrize("signal", BELIEF_SIGNALS)
def test_signals_of_the_belief_are_unknown_until_one_second_before_the_first_belief(signal):
    values = read_signal(signal, trace_of([(3.0, 0.1)], seconds=10), CASE, {})
    assert np.isnan(values).sum() == 2 * 40
    assert np.isfinite(values[2 * 40 :]).all()


@pytest.mark.parametrize("signal", BELIEF_SIGNALS)
def test_small_error_before_the_first_belief_does_not_pass(signal):
    (found,) = Eventually(signal=signal, op="<=", value=2.0, within=5.0).judge(trace_of([(30, 0.0)]), CASE)
    assert found.status is Status.INCONCLUSIVE
    assert found.detail == (f"{signal} is unknown up to t = 28.98 s: there was no belief yet",)
    assert found.measured.startswith("the run ended at t = 60.00 s")
    (found,) = Eventually(signal=signal, op="<=", value=2.0, within=30.0).judge(trace_of([(30, 0.0)]), CASE)
    assert found.status is Status.PASS


@pytest.mark.parametrize(("op", "status"), [("<=", Status.INCONCLUSIVE), (">=", Status.FAIL)])
def test_unknown_error_decides_neither_way(op, status):
    (found,) = Always(signal="localization_error", op=op, value=0.5).judge(trace_of([(30, 0.0)]), CASE)
    assert found.status is status


def test_length_of_the_plan_is_unknown_without_a_belief():
    trace = replace(trace_of([(3.0, 0.5)]), plans=(Path(np.array([[0.0, 0, 0], [2.0, 0, 0]]), TICK_RATE_HZ),))
    values = read_signal("distance_remaining", trace, synthetic_case({"goals": [{"name": "g", "pose": [5, 0]}]}), {})
    assert values[:40].tolist() == [5.0] * 40  # before the plan, the true distance from the goal
    assert np.isnan(values[40:80]).all()
    assert values[80:].tolist() == [1.5] * (len(values) - 80)


@pytest.mark.parametrize("bound", ["max", "rmse"])
def test_beliefs_at_rest_have_no_more_weight_than_beliefs_on_the_way(bound):
    """For 50 s, there are 5 beliefs per second without an error. The last belief has an error of 1 m for 10 s.

    In the last 9 s, it is old, and counts as 5 beliefs per second.
    """
    trace = trace_of([*((k / 5, 0.0) for k in range(250)), (50.0, 1.0)])
    (found,) = LocalizationError(**{bound: 0.5}).judge(trace, CASE)
    assert found.value == pytest.approx(1.0 if bound == "max" else math.sqrt((1 + 9 * 5) / (251 + 9 * 5)), rel=2e-3)
