"""Tests of pass-rate claims against scipy, exact enumeration, and simulated studies."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import binom, binomtest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult, error_result
from simscen.core.records.study import ClaimStatus
from simscen.judge.pass_rate_claims import anytime_limits, clopper_pearson_limits, decide, evaluate_claim
from simscen.model.acceptance import PassRate, fewest_runs

SIMULATED_STUDIES = 2000


def claim(**fields: object) -> PassRate:
    return PassRate.model_validate({"min": 0.9, "confidence": 0.95, **fields})


def results(outcomes: Sequence[bool]) -> list[RunResult]:
    return [
        RunResult(RunKey("s", seed), "s.yaml", Outcome.PASSED if passed else Outcome.FAILED)
        for seed, passed in enumerate(outcomes, start=1)
    ]


@pytest.mark.parametrize("passed", [0, 1, 17, 94, 99, 100])
@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.95, 0.999])
def test_clopper_pearson_limits_equal_those_of_scipy(passed: int, confidence: float) -> None:
    low = binomtest(passed, 100, alternative="greater").proportion_ci(confidence, "exact").low
    high = binomtest(passed, 100, alternative="less").proportion_ci(confidence, "exact").high
    assert clopper_pearson_limits(passed, 100, confidence) == pytest.approx((low, high), abs=1e-12)


@pytest.mark.parametrize(("rate", "confidence", "runs"), [(0.95, 0.95, 59), (0.99, 0.95, 299), (0.9, 0.9, 22)])
def test_fewest_runs_equal_those_of_the_zero_failure_test(rate: float, confidence: float, runs: int) -> None:
    assert fewest_runs(rate, confidence) == runs
    assert 1 - rate**runs >= confidence > 1 - rate ** (runs - 1)
    fixed = claim(min=rate, confidence=confidence)
    assert fixed.max_runs == runs
    assert evaluate_claim(fixed, results([True] * runs)).status is ClaimStatus.HELD
    assert evaluate_claim(fixed, results([True] * (runs - 1) + [False])).status is ClaimStatus.UNDECIDED


def test_a_fixed_claim_is_decided_by_all_runs_only() -> None:
    fixed = claim(runs=100)
    assert evaluate_claim(fixed, results([True] * 99)).status is ClaimStatus.UNDECIDED
    assert evaluate_claim(fixed, results([True] * 100)).status is ClaimStatus.HELD
    assert evaluate_claim(fixed, results([False] * 20 + [True] * 80)).status is ClaimStatus.REFUTED
    assert evaluate_claim(fixed, results([False] * 8 + [True] * 92)).status is ClaimStatus.UNDECIDED
    more = evaluate_claim(fixed, results([True] * 100 + [False] * 50))  # those of an earlier, longer session
    assert (more.status, more.runs, more.passed) == (ClaimStatus.HELD, 100, 100)


def false_decisions(true_rate: float, runs: int, held_from: int, refuted_below: int) -> tuple[float, float]:
    """Return the exact probabilities that a claim is held, and that it is refuted."""
    return float(binom.sf(held_from - 1, runs, true_rate)), float(binom.cdf(refuted_below - 1, runs, true_rate))


def test_error_rates_of_a_fixed_claim_are_exactly_bounded() -> None:
    fixed = claim(runs=200)
    status = [evaluate_claim(fixed, results([True] * k + [False] * (200 - k))).status for k in range(201)]
    held_from = status.index(ClaimStatus.HELD)
    refuted_below = status.index(ClaimStatus.UNDECIDED)
    assert all(claim_status is ClaimStatus.HELD for claim_status in status[held_from:])
    assert all(claim_status is ClaimStatus.REFUTED for claim_status in status[:refuted_below])
    held, _ = false_decisions(0.9 - 1e-9, 200, held_from, refuted_below)
    _, refuted = false_decisions(0.9, 200, held_from, refuted_below)
    assert 0.02 < held <= 0.05
    assert 0.02 < refuted <= 0.05


def simulated_decisions(tested: PassRate, rate: float, seed: int) -> tuple[float, float, float]:
    """Return the shares of simulated studies in which a claim is held and refuted, and the mean number of runs."""
    rng = np.random.default_rng(seed)
    status, runs = [], []
    for _ in range(SIMULATED_STUDIES):
        number, decision = decide(tested, (rng.random(tested.max_runs) < rate).tolist())
        status.append(decision)
        runs.append(number)
    held, refuted = (status.count(decision) / len(status) for decision in (ClaimStatus.HELD, ClaimStatus.REFUTED))
    return held, refuted, float(np.mean(runs))


def max_share(rate: float) -> float:
    """Return the largest share in simulations of an event with this probability, at 5 standard deviations."""
    return rate + 5 * math.sqrt(rate * (1 - rate) / SIMULATED_STUDIES)


def test_error_rates_of_sprt_in_simulated_studies() -> None:
    sprt = claim(method="sprt", target=0.97, power=0.9, runs=500)
    held, _, _ = simulated_decisions(sprt, 0.9, seed=1)
    assert held <= max_share(0.05)
    held_good, refuted_good, runs = simulated_decisions(sprt, 0.97, seed=2)
    assert refuted_good <= max_share(0.1)
    assert held_good > 0.8
    assert runs < 120  # an exact test with a fixed number of runs and this power needs 158


def test_error_rates_of_anytime_in_simulated_studies() -> None:
    anytime = claim(method="anytime", runs=400)
    held, refuted, _ = simulated_decisions(anytime, 0.9, seed=3)
    assert held + refuted <= max_share(0.05)  # at the limit, either decision is an error
    held, _, runs = simulated_decisions(anytime, 0.99, seed=4)
    assert held > 0.95
    assert runs < 150


def test_anytime_limits_cover_after_all_runs_at_once() -> None:
    rng, rate, missed = np.random.default_rng(5), 0.93, 0
    for _ in range(SIMULATED_STUDIES // 4):
        passed = np.cumsum(rng.random(300) < rate)
        runs = np.arange(1, 301)
        missed += bool(((runs + 1) * binom.pmf(passed, runs, rate) <= 0.1).any())
    assert missed / (SIMULATED_STUDIES // 4) <= 0.1 + 5 * math.sqrt(0.1 * 0.9 / (SIMULATED_STUDIES // 4))


@pytest.mark.parametrize(("passed", "runs"), [(0, 1), (1, 1), (3, 10), (118, 120), (5000, 5000)])
def test_anytime_limits_are_the_roots_of_the_mixture(passed: int, runs: int) -> None:
    low, high = anytime_limits(passed, runs, 0.95)
    assert 0.0 <= low <= passed / runs <= high <= 1.0
    assert (low == 0.0) == (passed == 0)
    assert (high == 1.0) == (passed == runs)
    for limit in (low, high):
        if 0.0 < limit < 1.0:
            assert (runs + 1) * binom.pmf(passed, runs, limit) == pytest.approx(0.05, rel=1e-6)


def test_a_sequential_claim_ignores_runs_after_its_decision() -> None:
    anytime = claim(method="anytime", runs=400)
    outcomes = [True] * 80
    first = evaluate_claim(anytime, results(outcomes))
    assert first.status is ClaimStatus.HELD
    assert evaluate_claim(anytime, results(outcomes + [False] * 60)) == first


def test_a_crash_of_the_stack_is_a_failure_and_any_other_error_blocks_the_claim() -> None:
    fixed = claim(runs=29)
    passed = results([True] * 28)
    crash = error_result(RunKey("s", 29), "s.yaml", RunFailure("stack-crashed", "stack nav: exited 1", by_stack=True))
    broken = error_result(RunKey("s", 29), "s.yaml", RunFailure("crashed", "killed (SIGKILL)"))
    by_stack = evaluate_claim(fixed, [*passed, crash])
    assert (by_stack.status, by_stack.passed, by_stack.runs, by_stack.errors) == (ClaimStatus.UNDECIDED, 28, 29, 0)
    by_simscen = evaluate_claim(fixed, [*passed, broken])
    assert (by_simscen.status, by_simscen.runs, by_simscen.errors) == (ClaimStatus.BLOCKED, 28, 1)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"method": "sprt"}, "`sprt` needs a `target`"),
        ({"method": "sprt", "target": 0.9}, "must be greater than `min`"),
        ({"target": 0.95}, "`target` is only for `method: sprt`"),
        ({"method": "anytime", "power": 0.95}, "`power` is only for `method: sprt`"),
        ({"min": 0.9999999}, "needs more than 1000000 runs"),
        ({"min": 1.0}, "less than 1"),
        ({"confidence": 1.0}, "less than or equal to 0.999999"),
    ],
)
def test_contradictory_claims_are_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        claim(**fields)


@pytest.mark.parametrize(("rate", "confidence"), [(0.1, 0.9), (0.1, 0.9999), (0.3, 0.91), (0.95, 0.95)])
def test_default_number_of_runs_proves_the_claim_if_all_pass(rate: float, confidence: float) -> None:
    claimed = claim(min=rate, confidence=confidence)
    assert evaluate_claim(claimed, results([True] * claimed.max_runs)).status is ClaimStatus.HELD


def test_limit_equal_to_the_claimed_rate_holds_and_does_not_refute() -> None:
    low, high = clopper_pearson_limits(95, 100, 0.95)
    assert evaluate_claim(claim(min=low, runs=100), results([True] * 95 + [False] * 5)).status is ClaimStatus.HELD
    assert evaluate_claim(claim(min=high, runs=100), results([True] * 95 + [False] * 5)).status is ClaimStatus.UNDECIDED


def test_anytime_claim_can_be_refuted_if_the_first_run_passed() -> None:
    status = evaluate_claim(claim(method="anytime", runs=400), results([True] + [False] * 30)).status
    assert status is ClaimStatus.REFUTED


def test_a_likelihood_ratio_that_equals_its_limit_decides() -> None:
    sprt = claim(min=0.5, target=0.75, confidence=0.5, power=0.5, method="sprt", runs=10)
    assert decide(sprt, [False, True]) == (1, ClaimStatus.REFUTED)  # 0.25 / 0.5 = 1 - power
    sprt = claim(min=0.375, target=0.75, confidence=0.5, power=0.9, method="sprt", runs=10)
    assert decide(sprt, [True, False]) == (1, ClaimStatus.HELD)  # 0.75 / 0.375 = 1 / (1 - confidence)


def test_a_rate_on_the_boundary_is_not_compatible_with_the_runs() -> None:
    anytime = claim(min=1 / 64, confidence=31 / 32, method="anytime", runs=5)
    assert decide(anytime, [True, False]) == (1, ClaimStatus.HELD)  # (1 + 1) / 64 = 1 - confidence
