"""Tests of formulas on whole runs: verdicts are final, and the sign of the margin is the verdict."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_formulas import CASE, FORMULAS, NUMBERS, VALUES, WINDOWS, horizon, run, validated

from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.stl.condition import Window
from simscen.criteria.stl.evaluation import EvaluationContext, robustness
from simscen.criteria.stl.robustness import ResponseRobustness
from simscen.judge.evaluation import judge


@settings(deadline=None)
@given(FORMULAS, VALUES, st.data())
def test_decided_verdict_holds_for_every_continuation(formula, p, data):
    """The interval of a short run holds the value of every continuation of it."""
    q = data.draw(st.lists(NUMBERS, min_size=len(p), max_size=len(p)))
    more = horizon(formula) + 1
    longer = [values + data.draw(st.lists(NUMBERS, min_size=more, max_size=more)) for values in (p, q)]
    short, whole = (
        robustness(validated(formula), EvaluationContext(run(*pq), CASE, run_ended=True)) for pq in ((p, q), longer)
    )
    assert short.low[0] <= whole.low[0] == whole.high[0] <= short.high[0]


@settings(deadline=None)
@given(FORMULAS, VALUES, st.booleans(), st.data())
def test_the_sign_of_the_margin_is_the_verdict_and_the_witness_supports_it(formula, p, ended, data):
    q = data.draw(st.lists(NUMBERS, min_size=len(p), max_size=len(p)))
    trace = run(p, q, ended)
    (verdict,) = judge([AnyCriterion.model_validate({"always": {**formula, "within": 1.0}})], trace, CASE)
    (finding,) = verdict.findings
    if finding.margin is not None and finding.status is not Status.INCONCLUSIVE:
        assert (finding.status is Status.PASS) == (finding.margin >= 0)
    if finding.status in (Status.PASS, Status.FAIL):
        signal = p if finding.what == "clearance" else q
        assert finding.value == signal[finding.tick // 240]
    if not ended:
        assert verdict.status is not Status.PASS


@settings(deadline=None)
@given(VALUES, NUMBERS, st.integers(0, 2), st.integers(0, 3))
def test_loosening_a_bound_never_turns_a_pass_into_a_fail(p, q, bound, by):
    formulas = [
        {"signal": "clearance", "op": op, "value": value, "within": 3.0}
        for op, values in ((">=", (bound, bound - by)), ("<=", (bound, bound + by)))
        for value in values
        if value > -1
    ]
    order = [Status.FAIL, Status.INCONCLUSIVE, Status.PASS]
    statuses = {}
    for operator in ("always", "eventually"):
        for formula in formulas:
            (verdict,) = judge([AnyCriterion.model_validate({operator: formula})], run(p, [q] * len(p)), CASE)
            statuses[operator, formula["op"], formula["value"]] = order.index(verdict.status)
    for (operator, op, value), status in statuses.items():
        looser = value - by if op == ">=" else value + by
        assert statuses.get((operator, op, looser), 2) >= status


@given(FORMULAS, VALUES, st.integers(1, 1000))
@settings(deadline=None)
def test_verdict_does_not_depend_on_the_start_tick(formula, p, later):
    trace = run(p, p)
    moved = replace(
        trace,
        **{
            name: Samples(getattr(trace, name).ticks + 240 * later, getattr(trace, name).values)
            for name in ("truth", "velocity", "clearance")
        },
    )
    original, shifted = (
        robustness(validated(formula), EvaluationContext(some, CASE, run_ended=True)) for some in (trace, moved)
    )
    assert original.low.tolist() == shifted.low.tolist()
    assert original.high.tolist() == shifted.high.tolist()


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_runs_with_few_samples_are_judged(samples):
    scene = EvaluationContext(run([1.0] * samples, [0.0] * samples), CASE, run_ended=True)
    assert len(robustness(validated({"signal": "clearance", "op": ">", "value": 0}), scene).low) == samples


@pytest.mark.parametrize("late", [[0, 0, 0, 1, 1], [0, 1, 0, 0, 0], [0, 60, -60, 0, 0]])
def test_uneven_samples_are_judged_at_their_own_times(late):
    trace = run([1.0, 1.0, -1.0, 1.0, 1.0], [0.0] * 5)
    trace = replace(trace, truth=Samples(trace.truth.ticks + np.array(late), trace.truth.values))
    context = EvaluationContext(trace, CASE, run_ended=True)
    formula = {"always": {"signal": "yaw_rate", "op": "<=", "value": 1, "within": 2.0}}
    found = robustness(validated(formula), context)
    assert found.low.tolist()[:2] == [1.0, 1.0]
    assert found.high.tolist() == [1.0] * 5


def test_a_window_without_a_later_sample_is_refused():
    scene = EvaluationContext(run([1.0] * 5, [0.0] * 5), CASE, run_ended=True)
    with pytest.raises(
        InvalidTrace, match=r"the window up to 1.9 s ahead contains no later sample: samples are 1 s apart"
    ):
        scene.sample_windows(Window(between=[1.1, 1.9]))
    window = scene.sample_windows(Window(between=[1.1, 2.0]))
    assert (window.first[0], window.last[0]) == (2, 2)


def test_single_sample_has_a_spacing_of_one_tick():
    window = EvaluationContext(run([1.0], [0.0]), CASE, run_ended=True).sample_windows(Window(within=1 / 240))
    assert (window.first.tolist(), window.last.tolist(), window.extends_past_end.tolist()) == ([0], [0], [True])


def test_nested_response_is_required_from_the_first_sample():
    premise, answer = ({"signal": name, "op": ">=", "value": 0.5} for name in ("clearance", "yaw_rate"))
    formula = validated({"all": [{"whenever": premise, "then": answer}]})
    scene = EvaluationContext(run([1.0, 0.0, 0.0], [-1.0, 1.0, 1.0]), CASE, run_ended=True)
    assert robustness(formula, scene).low.tolist() == [-0.5, 0.5, 0.5]


@pytest.mark.parametrize(("clearance", "may_be_tested"), [(0.75, True), (0.5, False)])
def test_premise_with_an_undecided_future_may_be_tested(clearance: float, may_be_tested: bool) -> None:
    later = {"eventually": {"signal": "yaw_rate", "op": ">", "value": 5, "within": 9}}
    premise = {"all": [{"signal": "clearance", "op": ">", "value": 0.5}, later]}
    formula = validated({"whenever": premise, "then": {"signal": "yaw_rate", "op": "<", "value": 9}})
    found = robustness(formula, EvaluationContext(run([clearance] * 3, [0.0] * 3), CASE, run_ended=True))
    assert isinstance(found, ResponseRobustness)
    assert not found.was_tested
    assert found.may_be_tested is may_be_tested


def test_nan_signal_is_reported_with_its_first_time():
    lost = Path(np.full((2, 3), np.nan), 480)
    trace = replace(run([1.0] * 5, [0.0] * 5), plans=(lost,))
    with pytest.raises(InvalidTrace, match=r"the plan is not finite at t = 2.00 s"):
        robustness(
            validated({"signal": "plan_deviation", "op": "<", "value": 1.0}),
            EvaluationContext(trace, CASE, run_ended=True),
        )


HOLD = {"signal": "clearance", "op": ">", "value": 0.5}
RELEASE = {"signal": "yaw_rate", "op": ">", "value": 0.5}


@settings(deadline=None)
@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=12), WINDOWS, st.booleans())
def test_the_witness_of_until_has_its_value_at_each_sample(values, window, ended):
    """Where the sign is known, the comparison that decides is as far from its bound as the value of `until` says."""
    p, q = ([float(value) for value in side] for side in zip(*values, strict=True))
    words = {"until": {"hold": HOLD, "release": RELEASE, "between": list(window)}}
    result = robustness(validated(words), EvaluationContext(run(p, q, ended), CASE, run_ended=ended))
    for sample in range(len(p)):
        for bound in ("low", "high"):
            value = result.bound(bound)[sample]
            decided = value > 0 if bound == "low" else value < 0
            if not decided or np.isinf(value):
                continue
            witness = result.witness(sample, bound)
            assert abs(witness.value - 0.5) == pytest.approx(abs(value))
            assert sample <= witness.sample <= sample + window[1]
            signal = p if witness.comparison.signal == "clearance" else q
            assert witness.value == signal[witness.sample]


def test_a_response_in_a_window_beyond_the_run_is_undecided():
    premise, answer = ({"signal": name, "op": ">=", "value": 0.5} for name in ("clearance", "yaw_rate"))
    formula = validated({"eventually": {"all": [{"whenever": premise, "then": answer}], "between": [10.0, 11.0]}})
    found = robustness(formula, EvaluationContext(run([1.0] * 3, [1.0] * 3), CASE, run_ended=True))
    assert found.low[0] < 0 < found.high[0]
