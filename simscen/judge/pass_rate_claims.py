"""Statistical tests of a claim: that a robot passes at least the share `min` of all runs.

The runs must be independent: each has its own seed, and its own random values if the scenario is varied. Whatever the
true pass rate is, each test keeps the stated error rate: if the rate is below `min`, the claim is held with a
probability of at most 1 - `confidence`.
"""

import math
from collections.abc import Sequence

from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.study import ClaimResult, ClaimStatus
from simscen.model.acceptance import PassRate


def evaluate_claim(claim: PassRate, results: Sequence[RunResult]) -> ClaimResult:
    """Return the result of a claim after these runs, which must be in the order of their seeds.

    A sequential test ends at the first run that decides it; later runs do not count. A crash or time-out of the stack
    under test counts as a failed run. Any other error blocks the claim.
    """
    outcomes = [result.outcome is Outcome.PASSED for result in results if is_counted(result)]
    errors = len(results) - len(outcomes)
    runs, status = decide(claim, outcomes[: claim.max_runs])
    passed = sum(outcomes[:runs])
    return ClaimResult(
        method=claim.method,
        min_rate=claim.min,
        confidence=claim.confidence,
        max_runs=claim.max_runs,
        status=ClaimStatus.BLOCKED if errors else status,
        passed=passed,
        runs=runs,
        errors=errors,
        limits=confidence_limits(claim, passed, runs) if runs else None,
        target=claim.target,
        power=claim.power if claim.method == "sprt" else None,
    )


def is_counted(result: RunResult) -> bool:
    """Return whether a run counts for the pass rate: it was judged, or the stack under test crashed."""
    return result.outcome is not Outcome.ERROR or (result.error is not None and result.error.by_stack)


def decide(claim: PassRate, outcomes: Sequence[bool]) -> tuple[int, ClaimStatus]:
    """Return the number of runs after which the claim is decided, and the decision.

    If it is undecided, this is the number of all runs. `outcomes` are True for passed runs, in order; there are at most
    `claim.max_runs`.
    """
    if claim.method == "fixed":
        runs = len(outcomes)
        is_complete = runs == claim.max_runs
        return runs, _by_limits(claim, sum(outcomes), runs) if is_complete else ClaimStatus.UNDECIDED
    test = _by_likelihood_ratio if claim.method == "sprt" else _by_mixture
    passed = 0
    for runs, has_passed in enumerate(outcomes, start=1):
        passed += has_passed
        status = test(claim, passed, runs)
        if status is not ClaimStatus.UNDECIDED:
            return runs, status
    return len(outcomes), ClaimStatus.UNDECIDED


def _by_limits(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    low, high = clopper_pearson_limits(passed, runs, claim.confidence)
    if low >= claim.min:
        return ClaimStatus.HELD
    return ClaimStatus.REFUTED if high < claim.min else ClaimStatus.UNDECIDED


def _by_mixture(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    """Return the decision of the method `anytime`: the claim is decided when `min` is outside the `anytime_limits`."""
    if _is_compatible(claim.min, passed, runs, claim.confidence):
        return ClaimStatus.UNDECIDED
    return ClaimStatus.HELD if passed > claim.min * runs else ClaimStatus.REFUTED


def _by_likelihood_ratio(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    """Return the decision of the method `sprt`, which compares the likelihoods of the rates `target` and `min`.

    The limits 1 / alpha and beta are those of Wald's inequalities: they bound each error rate, while Wald's usual
    approximation (1 - beta) / alpha only bounds their sum. (Wald: Sequential Tests of Statistical Hypotheses, 1945.)
    """
    assert claim.target is not None
    ratio = passed * math.log(claim.target / claim.min)
    ratio += (runs - passed) * math.log((1 - claim.target) / (1 - claim.min))
    if ratio >= -math.log(1 - claim.confidence):
        return ClaimStatus.HELD
    return ClaimStatus.REFUTED if ratio <= math.log(1 - claim.power) else ClaimStatus.UNDECIDED


def confidence_limits(claim: PassRate, passed: int, runs: int) -> tuple[float, float] | None:
    """Return the lower and the upper confidence limit of the pass rate by the method of the claim; None for `sprt`."""
    if claim.method == "sprt":
        return None
    limits = anytime_limits if claim.method == "anytime" else clopper_pearson_limits
    return limits(passed, runs, claim.confidence)


def clopper_pearson_limits(passed: int, runs: int, confidence: float) -> tuple[float, float]:
    """Return the exact lower and upper limit of a rate; each of them holds with the probability `confidence`.

    (Clopper and Pearson: The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial, 1934.)
    """
    from scipy.special import betaincinv  # the import takes half a second

    low = float(betaincinv(passed, runs - passed + 1, 1 - confidence)) if passed else 0.0
    high = float(betaincinv(passed + 1, runs - passed, confidence)) if passed < runs else 1.0
    return low, high


def anytime_limits(passed: int, runs: int, confidence: float) -> tuple[float, float]:
    """Return a lower and an upper limit of a rate, computed after any run of a sequence of runs.

    With the probability `confidence`, the limits after all of these runs are valid at the same time. They contain the
    rates p with (runs + 1) · P(passed | runs, p) > 1 - confidence: the beta-binomial mixture with a uniform prior.
    (Robbins: Statistical Methods Related to the Law of the Iterated Logarithm, 1970.)
    """
    rate = passed / runs
    low = _boundary(passed, runs, confidence, inside=rate, outside=0.0) if passed else 0.0
    high = _boundary(passed, runs, confidence, inside=rate, outside=1.0) if passed < runs else 1.0
    return low, high


def _boundary(passed: int, runs: int, confidence: float, inside: float, outside: float) -> float:
    """Return the boundary between a compatible rate `inside` and an incompatible rate `outside`, by bisection.

    Which rates are compatible is defined by `_is_compatible`.
    """
    while (middle := (inside + outside) / 2) not in (inside, outside):
        if _is_compatible(middle, passed, runs, confidence):
            inside = middle
        else:
            outside = middle
    return outside


def _is_compatible(rate: float, passed: int, runs: int, confidence: float) -> bool:
    """Return whether (runs + 1) · P(passed | runs, rate) > 1 - confidence. 0 < rate < 1."""
    log_count = math.lgamma(runs + 2) - math.lgamma(passed + 1) - math.lgamma(runs - passed + 1)
    return log_count + passed * math.log(rate) + (runs - passed) * math.log1p(-rate) > math.log(1 - confidence)
