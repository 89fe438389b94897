"""Property tests of temporal verdicts against a three-valued oracle."""

from hypothesis import given, settings
from hypothesis import strategies as st
from random_formulas import CASE, COMPARISONS, NUMBERS, RESPONSES, VALUES, inner, run

from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge

UNKNOWN = None
COMPARE = {
    ">=": lambda value, bound: value >= bound,
    "<=": lambda value, bound: value <= bound,
    ">": lambda value, bound: value > bound,
    "<": lambda value, bound: value < bound,
}


def negated(truth):
    return UNKNOWN if truth is UNKNOWN else not truth


def every(truths):
    """Kleene's conjunction."""
    truths = list(truths)
    return False if False in truths else UNKNOWN if UNKNOWN in truths else True


def some(truths):
    """Kleene's disjunction."""
    return negated(every(map(negated, truths)))


class Oracle:
    """Three-valued truth of formulas on a complete run with one sample per second."""

    def __init__(self, p, q):
        self.signals, self.count = {"clearance": p, "yaw_rate": q}, len(p)

    def windowed(self, truth, k, part):
        """Return the truths in the window of sample k, which are UNKNOWN beyond the end of the run."""
        start, end = part.get("between", (0, None))
        last = self.count - 1 if end is None else k + end
        inside = [truth(j) if j < self.count else UNKNOWN for j in range(k + start, last + 1)]
        return inside or [UNKNOWN]

    def truth(self, formula, k, start):
        """Return the truth of a formula at sample k; it is evaluated from the sample `start` on."""
        match formula:
            case {"signal": signal, "op": op, "value": value}:
                return COMPARE[op](self.signals[signal][k], value)
            case {"all": parts}:
                return every(self.truth(part, k, start) for part in parts)
            case {"any": parts}:
                return some(self.truth(part, k, start) for part in parts)
            case {"not": part}:
                return negated(self.truth(part, k, start))
            case {"whenever": premise, "then": answer}:
                return self.response(premise, answer, k, start)
            case {"until": {"hold": hold, "release": release, "between": [a, b]}}:
                later = start + a
                return some(
                    every([self.at(release, j, later), *(self.at(hold, i, start) for i in range(k, j))])
                    for j in range(k + a, k + b + 1)
                )
        ((operator, part),) = formula.items()
        later = start + part.get("between", (0, None))[0]
        combine = every if operator == "always" else some
        return combine(self.windowed(lambda j: self.truth(inner(part), j, later), k, part))

    def at(self, formula, k, start):
        return self.truth(formula, k, start) if k < self.count else UNKNOWN

    def response(self, premise, answer, k, start):
        """Return the truth of a response: UNKNOWN instead of True if the premise was never known to be true."""
        tested = any(self.truth(premise, j, start) is True for j in range(start, self.count))
        truth = every(
            some([negated(self.truth(premise, j, start)), self.truth(answer, j, start)]) for j in range(k, self.count)
        )
        return UNKNOWN if truth is True and not tested else truth


STATUS = {True: Status.PASS, False: Status.FAIL, UNKNOWN: Status.INCONCLUSIVE}


@settings(deadline=None, max_examples=300)
@given(RESPONSES, VALUES, st.data())
def test_verdicts_match_the_three_valued_oracle(formula, p, data):
    q = data.draw(st.lists(NUMBERS, min_size=len(p), max_size=len(p)))
    always = {"always": {"all": [formula], "between": [0, 1]}}
    (verdict,) = judge([AnyCriterion.model_validate(always)], run(p, q), CASE)
    assert verdict.status is STATUS[Oracle(p, q).truth(always, 0, 0)], verdict


@settings(deadline=None, max_examples=200)
@given(RESPONSES, RESPONSES, VALUES, st.data())
def test_whenever_passes_only_if_its_premise_was_known_to_hold(premise, answer, p, data):
    q = data.draw(st.lists(NUMBERS, min_size=len(p), max_size=len(p)))
    written = {"whenever": {"all": [premise]}, "then": answer}
    oracle = Oracle(p, q)
    (verdict,) = judge([AnyCriterion.model_validate(written)], run(p, q), CASE)
    assert verdict.status is STATUS[oracle.truth(written, 0, 0)], verdict
    if verdict.status is Status.PASS:
        assert any(oracle.truth(premise, k, 0) is True for k in range(len(p)))


@settings(deadline=None)
@given(COMPARISONS, COMPARISONS, VALUES)
def test_optional_premise_lets_an_untested_run_pass(premise, answer, p):
    written = {"whenever": {**premise, "required": False}, "then": answer}
    (verdict,) = judge([AnyCriterion.model_validate(written)], run(p, p), CASE)
    oracle = Oracle(p, p)
    held = [k for k in range(len(p)) if oracle.truth(premise, k, 0)]
    expected = all(oracle.truth(answer, k, 0) for k in held)
    assert verdict.status is (Status.PASS if expected else Status.FAIL)
