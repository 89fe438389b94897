"""Tests of the confidence intervals of an experiment, and of the comparison of two stacks."""

import pytest
from finished_runs import ARRIVED, HIT, run

from simscen.bench.navigation.summary import Trial, compare_experiment, success_interval, summarize
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.statistics import wilson_interval

SLOW = run(Outcome.PASSED, seconds=12.0)


def test_interval_is_over_worlds_not_seeds() -> None:
    trials = [Trial(r, world=f"{n}") for n, r in enumerate((ARRIVED, HIT, ARRIVED, ARRIVED, HIT, ARRIVED))]
    repeated = [Trial(trial.run, world=trial.world) for trial in trials for _ in range(20)]
    assert success_interval(trials) == success_interval(repeated)
    low, high = success_interval(trials) or (0.0, 0.0)
    assert low == pytest.approx(
        1 / 3, abs=0.01
    )  # with probability 2.5 %, at most two of six worlds drawn are successful
    assert high == 1.0


def test_equal_outcomes_give_the_wilson_interval() -> None:
    assert success_interval([Trial(ARRIVED, world=f"{n}") for n in range(10)]) == pytest.approx((0.722, 1.0), abs=1e-3)


def test_mixed_outcomes_give_a_nonempty_interval() -> None:
    low, high = success_interval([Trial(r, world=f"{n}") for n in range(6) for r in (ARRIVED, HIT)]) or (0.5, 0.5)
    assert (low, high) == pytest.approx(wilson_interval(3, 6))


def test_worlds_are_weighted_by_their_number_of_drives() -> None:
    many_drives, single_drives = [Trial(HIT, world="a")] * 15, [Trial(ARRIVED, world=f"{n}") for n in range(5)]
    row = summarize("maps", many_drives + single_drives)
    assert row.success == 0.25
    # If the world with 15 drives is k of six worlds drawn, then 1, 1/4, 1/10 … of the drives arrived;
    # P(k = 0) = 0.33, P(k <= 2) = 0.94, P(k <= 3) = 0.991.
    assert row.success_interval == pytest.approx((3 / 48, 1.0))


def test_one_world_has_no_interval() -> None:
    assert summarize("doorway", [Trial(ARRIVED, world="w")] * 20).success_interval is None


def test_stacks_are_compared_on_drives_that_both_completed() -> None:
    baseline = [Trial(r, 10.0, f"{n}") for n, r in enumerate((ARRIVED, ARRIVED, HIT, HIT, ARRIVED, run(Outcome.ERROR)))]
    candidate = [Trial(r, 10.0, f"{n}") for n, r in enumerate((SLOW, SLOW, SLOW, HIT, HIT, ARRIVED))]
    comparison = compare_experiment("fields", baseline, candidate)
    assert (comparison.pairs, comparison.better, comparison.worse) == (5, 1, 1)
    assert comparison.success.mean == 0.0
    assert comparison.seconds is not None and comparison.seconds.mean == 4.0  # of the two drives in which both arrived
    # 10 m at 2 m/s: 0.5 for 8 s, 5/12 for 12 s
    assert comparison.score is not None and comparison.score.mean == pytest.approx((3 * 5 / 12 - 3 * 0.5) / 5)


def test_interval_of_a_difference_equals_the_binomial_distribution() -> None:
    baseline = [Trial(r, 10.0, f"{n}") for n, r in enumerate((HIT, ARRIVED, ARRIVED, HIT, HIT))]
    candidate = [Trial(r, 10.0, f"{n}") for n, r in enumerate((ARRIVED, ARRIVED, ARRIVED, HIT, HIT))]
    comparison = compare_experiment("fields", baseline, candidate).success
    # The one world that differs is drawn k times of five, k ~ B(5, 1/5): P(k <= 2) = 0.942, P(k <= 3) = 0.993.
    assert (comparison.mean, comparison.interval) == (pytest.approx(0.2), pytest.approx((0.0, 0.6)))


def test_difference_equals_that_of_the_rates_in_the_table() -> None:
    worlds = ("a", "a", "a", "b", "c", "d", "e", "f")
    baseline = [Trial(ARRIVED, 10.0, world) for world in worlds]
    candidate = [Trial(HIT if world == "a" else SLOW, 10.0, world) for world in worlds]
    comparison = compare_experiment("maps", baseline, candidate)
    assert comparison.success.mean == pytest.approx(summarize("", candidate).success - summarize("", baseline).success)
    baseline_score, candidate_score = summarize("", baseline).score, summarize("", candidate).score
    assert comparison.score is not None and baseline_score is not None and candidate_score is not None
    assert comparison.score.mean == pytest.approx(candidate_score - baseline_score)


@pytest.mark.parametrize("finished", [ARRIVED, HIT])
def test_stacks_that_never_differ_may_still_differ_in_other_worlds(finished: RunFinished) -> None:
    trials = [Trial(finished, world=f"{n}") for n in range(10)]
    max_difference = 1.0 - wilson_interval(10, 10)[0]
    assert compare_experiment("fields", trials, trials).success.interval == pytest.approx(
        (-max_difference, max_difference)
    )


def test_runs_of_other_drives_are_not_compared() -> None:
    with pytest.raises(ValueError, match="not of the same drives"):
        compare_experiment("fields", [Trial(ARRIVED, world="a")], [Trial(ARRIVED, world="b")])
