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


def negate(truth):
    return UNKNOWN if truth is UNKNOWN else not truth


def conjunction(truths):
    """Return Kleene's conjunction."""
    truths = list(truths)
    return False if False in truths else UNKNOWN if UNKNOWN in truths else True


def disjunction(truths):
    """Return Kleene's disjunction."""
    return negate(conjunction(map(negate, truths)))


class Oracle:
    """Three-valued truth of formulas on a complete run with one sample per second."""

    def __init__(self, p, q):
        self.signals, self.count = {"clearance": p, "yaw_rate": q}, len(p)

    def window_truths(self, truth, k, part):
        """Return the truths in the window of sample k, which are UNKNOWN beyond the end of the run."""
        start, end = part.get("between", (0, None))
        last = self.count - 1 if end is None else k + end
        inside = [truth(j) if j < self.count else UNKNOWN for j in range(k + start, last + 1)]
        return inside or [UNKNOWN]

    def truth(self, formula, k, start):
        """Return the truth of a formula at sample k. `start` is the sample from which the formula is evaluated."""
        match formula:
            case {"signal": signal, "op": op, "value": value}:
                return COMPARE[op](self.signals[signal][k], value)
            case {"all": parts}:
                return conjunction(self.truth(part, k, start) for part in parts)
            case {"any": parts}:
                return disjunction(self.truth(part, k, start) for part in parts)
            case {"not": part}:
                return negate(self.truth(part, k, start))
            case {"whenever": premise, "then": answer}:
                return self.response(premise, answer, k, start)
            case {"until": {"hold": hold, "release": release, "between": [a, b]}}:
                later = start + a
                return disjunction(
                    conjunction(
                        [
                            self.truth_at(release, j, later),
                            *(self.truth_at(hold, i, start) for i in range(k, j)),
                        ]
                    )
                    for j in range(k + a, k + b + 1)
                )
        ((operator, part),) = formula.items()
        later = start + part.get("between", (0, None))[0]
        combine = conjunction if operator == "always" else disjunction
        return combine(self.window_truths(lambda j: self.truth(inner(part), j, later), k, part))

    def truth_at(self, formula, k, start):
        """Return the truth of a formula at sample k, or UNKNOWN beyond the end of the run."""
        return self.truth(formula, k, start) if k < self.count else UNKNOWN

    def response(self, premise, answer, k, start):
        """Return the truth of a response: UNKNOWN instead of True if the premise was never known to be true."""
        tested = any(self.truth(premise, j, start) is True for j in range(start, self.count))
        truth = conjunction(
            disjunction([negate(self.truth(premise, j, start)), self.truth(answer, j, start)])
            for j in range(k, self.count)
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
    criterion = {"whenever": {"all": [premise]}, "then": answer}
    oracle = Oracle(p, q)
    (verdict,) = judge([AnyCriterion.model_validate(criterion)], run(p, q), CASE)
    assert verdict.status is STATUS[oracle.truth(criterion, 0, 0)], verdict
    if verdict.status is Status.PASS:
        assert any(oracle.truth(premise, k, 0) is True for k in range(len(p)))


@settings(deadline=None)
@given(COMPARISONS, COMPARISONS, VALUES)
def test_optional_premise_lets_an_untested_run_pass(premise, answer, p):
    criterion = {"whenever": {**premise, "required": False}, "then": answer}
    (verdict,) = judge([AnyCriterion.model_validate(criterion)], run(p, p), CASE)
    oracle = Oracle(p, p)
    premise_samples = [k for k in range(len(p)) if oracle.truth(premise, k, 0)]
    expected = all(oracle.truth(answer, k, 0) for k in premise_samples)
    assert verdict.status is (Status.PASS if expected else Status.FAIL)
