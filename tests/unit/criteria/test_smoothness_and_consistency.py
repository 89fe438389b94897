"""Tests of smoothness and consistency that golden cases cannot express."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.core.statistics import nees_mean_bounds
from simscen.criteria.localization import LocalizationConsistency
from simscen.criteria.smoothness import Smoothness
from simscen.criteria.trace_signals.sparc_ldlj import sparc
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CASE = synthetic_case({})


def trace_with_speeds(speeds):
    trace = synthetic_trace({"seconds": (len(speeds) - 1) * 0.025, "truth": [[0, 0, 0]]})
    zero = np.zeros(len(speeds))
    return replace(trace, velocity=Samples(trace.truth.ticks, np.column_stack((speeds, zero, zero))))


def test_a_speed_that_never_changes_has_no_ldlj():
    (found,) = Smoothness(min_ldlj=-5.0).judge(trace_with_speeds(np.full(41, 0.5)), CASE)
    assert (found.status, found.measured) == (Status.INCONCLUSIVE, "the speed never changed")


@pytest.mark.parametrize(("max_speed", "status"), [(0.0099, Status.INCONCLUSIVE), (0.01, Status.PASS)])
def test_small_vibrations_do_not_count_as_driving(max_speed, status):
    speeds = max_speed * np.sin(np.linspace(0, np.pi, 81))
    assert Smoothness(min_sparc=-9.0).judge(trace_with_speeds(speeds), CASE)[0].status is status


def test_spectrum_uses_the_rate_of_the_truth():
    speeds = np.random.default_rng(6).uniform(0, 1, 81)
    assert Smoothness(min_sparc=-900.0).judge(trace_with_speeds(speeds), CASE)[0].value == sparc(speeds, 40.0)


def test_two_samples_are_enough_for_a_spectrum():
    speeds = np.array([1.0, 0.5])
    assert Smoothness(min_sparc=-900.0).judge(trace_with_speeds(speeds), CASE)[0].value == sparc(speeds, 40.0)


def test_smoothness_is_undefined_without_velocities():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    no_samples = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    criterion = Smoothness(max_acceleration=1.0, max_jerk=1.0, max_mean_jerk=1.0, min_sparc=-1.0, min_ldlj=-1.0)
    findings = criterion.judge(replace(trace, velocity=no_samples), CASE)
    assert [found.status for found in findings] == [Status.INCONCLUSIVE] * 5


def test_smoothness_needs_a_bound():
    with pytest.raises(ValueError, match="expected at least one of: max_acceleration, max_jerk"):
        Smoothness()


def trace_with_covariances(seconds, covariances, offset=0.1):
    trace = synthetic_trace({"seconds": seconds, "truth": [[0, 0, 0]], "belief": {"offset": [offset, 0, 0]}})
    values = trace.belief.values.copy()
    values[:, 3:9] = covariances
    return replace(trace, belief=Samples(trace.belief.ticks, values))


def test_singular_covariance_at_a_sample_is_overconfident():
    covariances = np.tile([0.01, 0, 0, 0.01, 0, 0.01], (101, 1))
    covariances[50] = [0.01, 0.01, 0, 0.01, 0, 0.01]
    trace = trace_with_covariances(10, covariances)
    (found,) = LocalizationConsistency(every=1.0).judge(trace, CASE)
    assert (found.status, found.measured, found.tick) == (Status.FAIL, "overconfident", 1200)
    assert LocalizationConsistency(every=3.0).judge(trace, CASE)[0].status is Status.PASS


def test_samples_are_periodic_from_the_first_belief_or_the_given_time():
    covariances = np.tile([0.01, 0, 0, 0.01, 0, 0.01], (101, 1))
    covariances[30:] = [0.0025, 0, 0, 0.0025, 0, 0.0025]
    trace = trace_with_covariances(10, covariances)
    (whole_run,) = LocalizationConsistency(every=2.0).judge(trace, CASE)
    assert whole_run.value == pytest.approx((2 * 1.0 + 4 * 4.0) / 6)
    assert whole_run.tick == 960
    (from_2_5_s,) = LocalizationConsistency(every=2.0, after=2.5).judge(trace, CASE)
    assert from_2_5_s.value == pytest.approx((1.0 + 3 * 4.0) / 4)


@pytest.mark.parametrize("both_sides", [True, False])
def test_bounds_are_two_sided_only_if_both_sides_are_checked(both_sides):
    trace = trace_with_covariances(10, np.tile([0.01, 0, 0, 0.01, 0, 0.01], (101, 1)))
    findings = LocalizationConsistency(every=1.0, both_sides=both_sides).judge(trace, CASE)
    high = findings[0].value + findings[0].margin
    if both_sides:
        assert high == pytest.approx(nees_mean_bounds(11, 3, 0.95)[1])
        assert findings[1].value - findings[1].margin == pytest.approx(nees_mean_bounds(11, 3, 0.95)[0])
    else:
        assert high == pytest.approx(nees_mean_bounds(11, 3, 0.90)[1])
        assert len(findings) == 1


def test_last_belief_is_sampled():
    trace = trace_with_covariances(10, np.tile([0.01, 0, 0, 0.01, 0, 0.01], (101, 1)))
    (found,) = LocalizationConsistency(every=1.0, after=10.0).judge(trace, CASE)
    assert found.status is Status.PASS
    assert "(mean of 1 NEES" in found.limit
