"""Tests of runs with uneven, sparse, or missing samples, as in logs of real robots and damaged logs."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import COMPLETE_COVERAGE, Evidence, LogCoverage, Status
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.trace_signals.sparc_ldlj import sparc
from simscen.criteria.trace_signals.trace_checks import check_recorded_signals, time_gaps
from simscen.judge.evaluation import judge
from simscen.judge.run_result import judge_run
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

EXTERNAL_LOG = LogCoverage(recorded_by_simscen=False)
TICK_RATE_HZ = 240


def drive(times, speeds, clearance=0.5):
    """Return a run along x, sampled at these times (s) with these speeds."""
    ticks = np.round(np.array(times) * TICK_RATE_HZ).astype(np.int64)
    speeds = np.array(speeds, dtype=np.float64)
    trace = synthetic_trace({"seconds": float(times[-1]), "truth": [[0, 0, 0]]})
    still = np.zeros(len(ticks))
    x = np.concatenate(([0.0], np.cumsum(speeds[:-1] * np.diff(ticks) / TICK_RATE_HZ)))
    return replace(
        trace,
        truth=Samples(ticks, np.column_stack((x, still, still))),
        velocity=Samples(ticks, np.column_stack((speeds, still, still))),
        clearance=Samples(ticks, np.full((len(ticks), 1), clearance)),
        end=int(ticks[-1]),
    )


def result(trace, *criteria, coverage=EXTERNAL_LOG):
    entries = [AnyCriterion.model_validate(words) for words in criteria]
    return judge_run(RunKey("a", 7), "a", entries, trace, synthetic_case({}), coverage=coverage)


def oscillating_speeds(times):
    """Return speeds that rise and fall in 4 s and oscillate at 1 Hz."""
    t = np.array(times)
    return 0.5 * np.sin(np.pi * t / 4) * (1 + 0.2 * np.sin(2 * np.pi * t))


EVEN = np.arange(0, 4.0001, 1 / 40)


@pytest.mark.parametrize(
    "times",
    [
        np.delete(EVEN, 1),
        np.delete(EVEN, [5, 40, 41, 90]),
        np.sort(EVEN + np.random.default_rng(3).uniform(-0.004, 0.004, len(EVEN)).clip(-EVEN, None)),
        np.arange(0, 4.0001, 1 / 30),
    ],
    ids=["a late second sample", "lost samples", "jitter", "30 Hz"],
)
def test_smoothness_does_not_depend_on_the_spacing_of_samples(times):
    even, uneven = (result(drive(each, oscillating_speeds(each)), {"collisions": {}}).metrics for each in (EVEN, times))
    assert uneven["sparc"] == pytest.approx(even["sparc"], abs=0.03)
    assert uneven["mean_jerk"] == pytest.approx(even["mean_jerk"], rel=0.5)
    bound = {"smoothness": {"min_sparc": even["sparc"] + 0.1}}
    assert result(drive(times, oscillating_speeds(times)), bound).verdicts[0].status is Status.FAIL


def test_initial_gap_of_a_quarter_second_does_not_hide_oscillation():
    times = np.concatenate(([0.0], EVEN[11:]))
    rough = drive(times, oscillating_speeds(times))
    found = result(rough, {"smoothness": {"min_sparc": -2}})
    assert found.verdicts[0].status is not Status.PASS
    assert sparc(oscillating_speeds(times), 1 / 0.275) > -2, "the value at the rate of the first gap"


@pytest.mark.parametrize("count", [1, 2, 3])
def test_smoothness_of_a_few_samples_is_never_an_error(count):
    found = result(drive(EVEN[:count], np.full(count, 0.5)), {"smoothness": {"min_sparc": -1.5, "min_ldlj": -1}})
    assert found.verdicts[0].status is not Status.ERROR


def test_smoothness_is_inconclusive_with_sparse_samples():
    times = np.arange(0, 4.0001, 0.1)
    found = result(drive(times, oscillating_speeds(times)), {"smoothness": {"min_sparc": -9}})
    (finding,) = found.verdicts[0].findings
    assert finding.status is Status.INCONCLUSIVE
    assert finding.measured == "the truth has 10.0 samples a second, too few for changes up to 10 Hz"


@pytest.mark.parametrize("name", ["speed", "always", "eventually", "until", "whenever"])
def test_criteria_judge_uneven_samples(name):
    slow = {"signal": "speed", "op": "<=", "value": 0.7}
    written = {
        "speed": {"speed": {"max": 0.7}},
        "always": {"always": {**slow, "within": 2.0}},
        "eventually": {"eventually": {"signal": "speed", "op": ">", "value": 0.3, "within": 2.0}},
        "until": {"until": {"hold": slow, "release": {"signal": "travelled", "op": ">", "value": 0.2}}},
        "whenever": {"whenever": slow, "then": {"eventually": {"signal": "speed", "op": "<=", "value": 0.7}}},
    }[name]
    times = np.delete(np.arange(0, 4.0001, 1 / 30), [7, 50])
    found = result(drive(times, oscillating_speeds(times)), written)
    assert found.outcome is Outcome.PASSED, found


def test_time_windows_do_not_depend_on_sample_counts():
    """Of the samples at 0, 0.1, 0.2, 1.0 and 1.1 s, the fourth is 1 s ahead and not 0.3 s."""
    times = [0, 0.1, 0.2, 1.0, 1.1]
    trace = drive(times, [0.1, 0.1, 0.1, 0.9, 0.1])
    for within, status in ((0.5, Status.PASS), (1.0, Status.FAIL)):
        entry = AnyCriterion.model_validate({"always": {"signal": "speed", "op": "<=", "value": 0.5, "within": within}})
        (verdict,) = judge([entry], trace, synthetic_case({}))
        assert verdict.status is status


def test_unused_undefined_metric_is_no_error():
    times = np.delete(EVEN, range(20, 50))
    found = result(drive(times, oscillating_speeds(times)), {"speed": {"max": 1.0}})
    assert found.outcome is Outcome.PASSED
    assert found.undefined["mean_jerk"].startswith("the truth has no sample from t = 0.47 s to 1.25 s")
    assert found.metrics["max_speed"] is not None


def test_non_finite_belief_in_a_third_party_log_affects_only_its_criteria():
    trace = drive(EVEN, oscillating_speeds(EVEN))
    belief = np.full((1, 9), np.nan)
    trace = replace(trace, belief=Samples(np.array([5]), belief))
    assert result(trace, {"speed": {"max": 1.0}}).outcome is Outcome.PASSED
    assert result(trace, {"localization_error": {"max": 1.0}}).outcome is Outcome.ERROR
    assert result(trace, {"speed": {"max": 1.0}}, coverage=COMPLETE_COVERAGE).outcome is Outcome.ERROR


CUTS = {
    "the end": lambda t: t <= 1.0,
    "the start": lambda t: t >= 3.0,
    "the middle": lambda t: (t < 1.0) | (t > 2.5),
}


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("coverage", [COMPLETE_COVERAGE, EXTERNAL_LOG], ids=["own", "foreign"])
@pytest.mark.parametrize("signal", ["truth", "clearance"])
def test_partial_coverage_does_not_pass(cut, coverage, signal):
    trace = drive(EVEN, oscillating_speeds(EVEN))
    kept = CUTS[cut](EVEN)
    names = ("truth", "velocity") if signal == "truth" else ("clearance",)
    parts = {name: Samples(getattr(trace, name).ticks[kept], getattr(trace, name).values[kept]) for name in names}
    criterion = {"speed": {"max": 1.0}} if signal == "truth" else {"clearance": {"min": 0.3}}
    found = result(replace(trace, **parts), criterion, coverage=coverage)
    (finding,) = found.verdicts[0].findings
    assert finding.status is Status.INCONCLUSIVE
    assert f"so far, but the {signal} has no sample from t = " in finding.measured
    metric = "max_speed" if signal == "truth" else "min_clearance"
    assert found.metrics[metric] is None
    strict = {"speed": {"max": 0.01}} if signal == "truth" else {"clearance": {"min": 0.6}}
    assert result(replace(trace, **parts), strict, coverage=coverage).verdicts[0].status is Status.FAIL


def test_gaps_are_named_by_evidence():
    trace = drive([0.0, 1.0, 2.5], [0.0, 0.0, 0.0])
    gap = "has no sample from t = 1.00 s to 2.50 s"
    assert time_gaps(trace) == {
        Evidence.TRUTH: f"the truth {gap}",
        Evidence.VELOCITY: f"the truth {gap}",
        Evidence.CLEARANCE: f"the clearance {gap}",
    }
    assert time_gaps(drive([0.0, 1.0, 2.0], [0.0, 0.0, 0.0])) == {}
    assert time_gaps(replace(trace, truth=Samples(np.empty(0, dtype=np.int64), np.empty((0, 3))))).keys() == {
        Evidence.CLEARANCE
    }


@pytest.mark.parametrize("signal", ["truth", "clearance", "belief"])
@pytest.mark.parametrize("order", [[0, 2, 1, 3], [0, 1, 1, 3]])
def test_unsorted_samples_in_a_simscen_log_are_an_error(signal, order):
    trace = drive(EVEN[:4], [0.0] * 4)
    trace = replace(trace, belief=Samples(trace.truth.ticks, np.zeros((4, 9))))
    check_recorded_signals(trace)
    samples = getattr(trace, signal)
    broken = replace(trace, **{signal: Samples(samples.ticks[order], samples.values[order])})
    with pytest.raises(InvalidTrace, match=f"the samples of the {signal} are not in chronological order after t = "):
        check_recorded_signals(broken)
    assert result(broken, {"collisions": {}}, coverage=COMPLETE_COVERAGE).outcome is Outcome.ERROR
