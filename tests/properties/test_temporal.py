"""Property tests of temporal formulas against rtamt, on long traces without NaN."""

import pytest
import rtamt
from hypothesis import given, settings
from hypothesis import strategies as st
from random_formulas import CASE, FORMULAS, NUMBERS, SIGNALS, horizon, inner, run, validated

from simscen.criteria.stl.evaluation import EvaluationContext, robustness


def as_rtamt(formula):
    """Return a formula in the syntax of rtamt."""
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


@settings(max_examples=40, deadline=None)
@given(FORMULAS, st.data())
def test_robustness_matches_rtamt_on_long_traces(formula, data):
    length = horizon(formula) + 2  # rtamt cannot read a trace of one sample
    p, q = (data.draw(st.lists(NUMBERS, min_size=length, max_size=length)) for _ in "pq")
    spec = rtamt.StlDiscreteTimeSpecification()
    spec.declare_var("p", "float")
    spec.declare_var("q", "float")
    spec.spec = f"out = {as_rtamt(formula)}"
    spec.parse()
    theirs = spec.evaluate({"time": list(range(length)), "p": p, "q": q})[0][1]
    ours = robustness(validated(formula), EvaluationContext(run(p, q), CASE, run_ended=True))
    assert ours.low[0] == ours.high[0] == pytest.approx(theirs, abs=1e-12)
