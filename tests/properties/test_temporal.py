"""Temporal formulas against two oracles: rtamt, and brute force over every window."""

import math
from dataclasses import replace

import numpy as np
import pytest
import rtamt
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.samples import Samples
from simscen.core.verdict import Status
from simscen.criteria import monitor
from simscen.criteria.condition import Condition
from simscen.criteria.criterion import AnyCriterion
from simscen.criteria.formula import Scene, judged
from simscen.criteria.monitor import Ahead, Window
from simscen.judge.judge import judge
from simscen.judge.sketch import sketch, sketch_case

CASE = sketch_case({"clearance_range": math.inf})
SIGNALS = {"clearance": "p", "yaw_rate": "q"}
NUMBERS = st.integers(-3, 3).map(float)
VALUES = st.lists(NUMBERS, min_size=1, max_size=12)


def run(p, q, ended=True):
    """A run with these clearances and yaw rates, one sample a second."""
    trace = sketch({"seconds": 0, "truth": [[0, 0, 0]], "ended": "navigation ended" if ended else None})
    ticks = np.arange(len(p), dtype=np.int64) * 240
    still = np.zeros((len(p), 3))
    turning = np.column_stack((still[:, :2], q))
    truth, clearance = Samples(ticks, still), Samples(ticks, np.array(p, dtype=np.float64)[:, np.newaxis])
    return replace(trace, truth=truth, velocity=Samples(ticks, turning), clearance=clearance, end=int(ticks[-1]))


WINDOWS = st.tuples(st.integers(0, 4), st.integers(1, 4)).map(lambda w: (w[0], w[0] + w[1]))
BOUNDS = st.tuples(
    st.sampled_from(sorted(SIGNALS)), st.sampled_from([">=", "<=", ">", "<"]), st.sampled_from([0, 1, 2])
)
COMPARISONS = BOUNDS.map(lambda bound: dict(zip(("signal", "op", "value"), bound, strict=True)))


def larger(smaller):
    return st.one_of(
        st.lists(smaller, min_size=1, max_size=3).map(lambda parts: {"all": parts}),
        st.lists(smaller, min_size=1, max_size=3).map(lambda parts: {"any": parts}),
        smaller.map(lambda part: {"not": part}),
        st.tuples(st.sampled_from(["always", "eventually"]), WINDOWS, smaller).map(
            lambda parts: {parts[0]: {**parts[2], "between": list(parts[1])}}
        ),
        st.tuples(smaller, smaller, WINDOWS).map(
            lambda parts: {"until": {"hold": parts[0], "release": parts[1], "between": list(parts[2])}}
        ),
    )


FORMULAS = st.recursive(COMPARISONS, larger, max_leaves=5)


def as_rtamt(formula):
    match formula:
        case {"all": parts}:
            return "(" + " and ".join(as_rtamt(part) for part in parts) + ")"
        case {"any": parts}:
            return "(" + " or ".join(as_rtamt(part) for part in parts) + ")"
        case {"not": part}:
            return f"(not {as_rtamt(part)})"
        case {"until": {"hold": hold, "release": release, "between": [a, b]}}:
            return f"({as_rtamt(hold)} until[{a}s,{b}s] {as_rtamt(release)})"
        case {"signal": signal, "op": op, "value": value}:
            return f"({SIGNALS[signal]} {op} {value})"
    ((operator, part),) = formula.items()
    a, b = part["between"]
    return f"({operator}[{a}s,{b}s] {as_rtamt(inner(part))})"


def inner(part):
    return {key: value for key, value in part.items() if key != "between"}


def horizon(formula):
    match formula:
        case {"all": parts} | {"any": parts}:
            return max(horizon(part) for part in parts)
        case {"not": part}:
            return horizon(part)
        case {"until": {"hold": hold, "release": release, "between": [_, b]}}:
            return b + max(horizon(hold), horizon(release))
        case {"signal": _}:
            return 0
    (part,) = formula.values()
    return part["between"][1] + horizon(inner(part))


def validated(formula):
    """As YAML gives it: the bounds of windows are numbers of seconds."""
    return Condition.model_validate(formula)


@settings(max_examples=60, deadline=None)
@given(FORMULAS, st.data())
def test_the_robustness_is_that_of_rtamt_where_the_trace_is_long_enough(formula, data):
    length = horizon(formula) + 2  # rtamt cannot read a trace of one sample
    p, q = (data.draw(st.lists(NUMBERS, min_size=length, max_size=length)) for _ in "pq")
    spec = rtamt.StlDiscreteTimeSpecification()
    spec.declare_var("p", "float")
    spec.declare_var("q", "float")
    spec.spec = f"out = {as_rtamt(formula)}"
    spec.parse()
    theirs = spec.evaluate({"time": list(range(length)), "p": p, "q": q})[0][1]
    ours = judged(validated(formula), Scene.of(run(p, q), CASE, over=True))
    assert ours.low[0] == ours.high[0] == pytest.approx(theirs, abs=1e-12)


@settings(max_examples=150, deadline=None)
@given(FORMULAS, VALUES, st.data())
def test_what_is_decided_stays_so_however_the_run_would_have_gone_on(formula, p, data):
    """The interval of a short run holds the value of every continuation of it."""
    q = data.draw(st.lists(NUMBERS, min_size=len(p), max_size=len(p)))
    more = horizon(formula) + 1
    longer = [values + data.draw(st.lists(NUMBERS, min_size=more, max_size=more)) for values in (p, q)]
    short, whole = (judged(validated(formula), Scene.of(run(*pq), CASE, over=True)) for pq in ((p, q), longer))
    assert short.low[0] <= whole.low[0] == whole.high[0] <= short.high[0]


def brute(operator, values, window, ahead, others=None):
    """By definition, over each pair of samples."""
    n = len(values)
    answers = []
    for t in range(n):
        first = t + window.first
        closes = window.last is None and ahead.over
        last = n - 1 if closes else max(n, first) + 1 if window.last is None else t + window.last

        def at(signal, k):
            return signal[k] if k < n else ahead.beyond

        if first > last:
            held = min((at(values, i) for i in range(t, first)), default=math.inf)
            answers.append(min(held, ahead.beyond) if operator == "until" else ahead.beyond)
            continue
        reach = range(first, last + 1)
        if operator == "always":
            answers.append(min(at(values, k) for k in reach))
        elif operator == "eventually":
            answers.append(max(at(values, k) for k in reach))
        else:
            holds = [min((at(values, i) for i in range(t, k)), default=math.inf) for k in reach]
            answers.append(max(min(at(others, k), held) for k, held in zip(reach, holds, strict=True)))
    return answers


@given(
    VALUES,
    st.integers(0, 15),
    st.none() | st.integers(0, 15),
    st.sampled_from([-math.inf, math.inf]),
    st.booleans(),
    st.data(),
)
def test_every_operator_is_what_brute_force_over_all_windows_says(values, first, length, beyond, over, data):
    others = data.draw(st.lists(NUMBERS, min_size=len(values), max_size=len(values)))
    window, ahead = Window(first, None if length is None else first + length), Ahead(beyond, over)
    p, q = np.array(values), np.array(others)
    assert monitor.always(p, window, ahead).tolist() == brute("always", values, window, ahead)
    assert monitor.eventually(p, window, ahead).tolist() == brute("eventually", values, window, ahead)
    assert monitor.until(p, q, window, ahead).tolist() == brute("until", values, window, ahead, others)


@settings(max_examples=150, deadline=None)
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


@settings(max_examples=100, deadline=None)
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
@settings(max_examples=60, deadline=None)
def test_a_run_that_begins_later_is_judged_alike(formula, p, later):
    trace = run(p, p)
    moved = replace(
        trace,
        **{
            name: Samples(getattr(trace, name).ticks + 240 * later, getattr(trace, name).values)
            for name in ("truth", "velocity", "clearance")
        },
    )
    one, other = (judged(validated(formula), Scene.of(some, CASE, over=True)) for some in (trace, moved))
    assert one.low.tolist() == other.low.tolist()
    assert one.high.tolist() == other.high.tolist()


def test_until_over_a_whole_minute_takes_no_cubic_time():
    """rtamt 0.4.10 takes 106 s for this; by definition it is 1201 samples and as many windows."""
    chance = np.random.default_rng(3)
    p, q = chance.normal(1.0, 1.0, 1201), chance.normal(-2.0, 1.0, 1201)
    whole = monitor.until(p, q, Window(0, 1200), Ahead(-math.inf, True))
    assert whole[0] == max(min(q[k], p[:k].min(initial=math.inf)) for k in range(1201))
