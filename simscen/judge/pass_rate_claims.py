"""Statistical tests of a claim that the pass rate of a scenario is at least `min`.

The runs must be independent. If the true pass rate is below `min`, a test accepts the claim with a probability of at
most 1 - `confidence`.
"""

import math
from collections.abc import Sequence

from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.study import ClaimResult, ClaimStatus
from simscen.model.acceptance import PassRate


def evaluate_claim(claim: PassRate, results: Sequence[RunResult]) -> ClaimResult:
    """Return the result of a claim. `results` are in the order of their seeds.

    A sequential test ends at the first run that decides the claim; later runs do not count. A crash or timeout of the
    stack under test counts as a failed run. Any other error blocks the claim, even in a run after the decision.
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
    """Return whether a run counts for the pass rate: a judged run, or one with a crash or timeout of the stack."""
    return result.outcome is not Outcome.ERROR or (result.error is not None and result.error.by_stack)


def decide(claim: PassRate, outcomes: Sequence[bool]) -> tuple[int, ClaimStatus]:
    """Return the number of runs that decide the claim, and the decision; all runs and UNDECIDED without a decision.

    `outcomes` has one entry for each run, in order: True if the run passed. It has at most `claim.max_runs` entries.
    """
    if claim.method == "fixed":
        runs = len(outcomes)
        is_complete = runs == claim.max_runs
        return runs, _decide_by_limits(claim, sum(outcomes), runs) if is_complete else ClaimStatus.UNDECIDED
    test = _decide_by_likelihood_ratio if claim.method == "sprt" else _decide_by_anytime_limits
    passed = 0
    for runs, has_passed in enumerate(outcomes, start=1):
        passed += has_passed
        status = test(claim, passed, runs)
        if status is not ClaimStatus.UNDECIDED:
            return runs, status
    return len(outcomes), ClaimStatus.UNDECIDED


def _decide_by_limits(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    """Return the decision of the method `fixed`, which uses the `clopper_pearson_limits`."""
    low, high = clopper_pearson_limits(passed, runs, claim.confidence)
    # isclose: the exact limit can equal `min`, such as 10 % for 1 of 1 runs with a confidence of 90 %.
    if low >= claim.min or math.isclose(low, claim.min):
        return ClaimStatus.HELD
    return ClaimStatus.REFUTED if high < claim.min else ClaimStatus.UNDECIDED


def _decide_by_anytime_limits(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    """Return the decision of the method `anytime`: undecided while `min` is within the `anytime_limits`."""
    if _is_compatible(claim.min, passed, runs, claim.confidence):
        return ClaimStatus.UNDECIDED
    return ClaimStatus.HELD if passed > claim.min * runs else ClaimStatus.REFUTED


def _decide_by_likelihood_ratio(claim: PassRate, passed: int, runs: int) -> ClaimStatus:
    """Return the decision of the method `sprt`, which compares the likelihoods of the rates `target` and `min`.

    (Wald: Sequential Tests of Statistical Hypotheses, 1945.)
    """
    # The thresholds 1 / alpha and beta bound each error rate. Wald's (1 - beta) / alpha bounds only the sum of both.
    assert claim.target is not None
    ratio = passed * math.log(claim.target / claim.min)
    ratio += (runs - passed) * math.log((1 - claim.target) / (1 - claim.min))
    if ratio >= -math.log(1 - claim.confidence):
        return ClaimStatus.HELD
    return ClaimStatus.REFUTED if ratio <= math.log(1 - claim.power) else ClaimStatus.UNDECIDED


def confidence_limits(claim: PassRate, passed: int, runs: int) -> tuple[float, float] | None:
    """Return the lower and upper confidence limit of the pass rate; None for the method `sprt`."""
    if claim.method == "sprt":
        return None
    limits = anytime_limits if claim.method == "anytime" else clopper_pearson_limits
    return limits(passed, runs, claim.confidence)


def clopper_pearson_limits(passed: int, runs: int, confidence: float) -> tuple[float, float]:
    """Return the exact lower and upper limit of a rate, each with the one-sided `confidence`.

    (Clopper and Pearson: The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial, 1934.)
    """
    from scipy.special import betaincinv  # the import takes half a second

    low = float(betaincinv(passed, runs - passed + 1, 1 - confidence)) if passed else 0.0
    high = float(betaincinv(passed + 1, runs - passed, confidence)) if passed < runs else 1.0
    return low, high


def anytime_limits(passed: int, runs: int, confidence: float) -> tuple[float, float]:
    """Return a lower and an upper limit of a rate that remain valid if the limits are computed after every run.

    Method: beta-binomial mixture with a uniform prior. (Robbins: Statistical Methods Related to the Law of the Iterated
    Logarithm, 1970.)
    """
    rate = passed / runs
    low = _boundary(passed, runs, confidence, inside=rate, outside=0.0) if passed else 0.0
    high = _boundary(passed, runs, confidence, inside=rate, outside=1.0) if passed < runs else 1.0
    return low, high


def _boundary(passed: int, runs: int, confidence: float, inside: float, outside: float) -> float:
    """Return the boundary between a compatible rate `inside` and an incompatible rate `outside`, by bisection."""
    while (middle := (inside + outside) / 2) not in (inside, outside):
        if _is_compatible(middle, passed, runs, confidence):
            inside = middle
        else:
            outside = middle
    return outside


def _is_compatible(rate: float, passed: int, runs: int, confidence: float) -> bool:
    """Return whether the rate (between 0 and 1) is within the `anytime_limits`.

    The condition is (runs + 1) · P(passed | runs, rate) > 1 - confidence.
    """
    log_count = math.lgamma(runs + 2) - math.lgamma(passed + 1) - math.lgamma(runs - passed + 1)
    return log_count + passed * math.log(rate) + (runs - passed) * math.log1p(-rate) > math.log(1 - confidence)
