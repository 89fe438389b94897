"""Tests of significant changes, against scipy and the definition of Holm's correction."""

import pytest
from scipy.stats import binomtest, wilcoxon

from simscen.judge.significance import PASS_RATE, PairedSample, Significance, signed_rank_test, significant_changes


def sample(
    pairs: list[tuple[float, float]], what: str = "time_to_goal", higher_is_better: bool | None = False
) -> PairedSample:
    return PairedSample("s", what, "s", pairs, higher_is_better)


SLOWER = [(10.0 + k / 10, 12.0 + k / 7) for k in range(8)]
FLIPPED = [(1.0, 0.0)] * 7 + [(0.0, 1.0)] + [(1.0, 1.0)] * 4


def test_defaults_are_five_percent() -> None:
    assert Significance() == Significance(0.05, 0.05)


def test_pass_rates_are_tested_by_flips_and_metrics_by_ranks() -> None:
    assert sample(FLIPPED, PASS_RATE).p_value() == pytest.approx(binomtest(1, 8).pvalue)
    assert sample(FLIPPED).p_value() == pytest.approx(wilcoxon([two - one for one, two in FLIPPED]).pvalue)
    assert sample(SLOWER).p_value() == pytest.approx(2 / 2**8)


def test_ties_do_not_count_in_ranks() -> None:
    assert signed_rank_test([0.0, 0.0]) == 1.0
    assert signed_rank_test([0.0, 1.0, 2.0, 3.0]) == pytest.approx(2 / 2**3)


def test_a_change_has_the_means_of_its_pairs_and_a_direction() -> None:
    (change,) = significant_changes([sample(SLOWER)], Significance())
    assert change.baseline == pytest.approx(10.35)
    assert change.value == pytest.approx(12.5)
    assert (change.scenario, change.what, change.unit, change.pairs, change.is_worse) == (
        "s",
        "time_to_goal",
        "s",
        8,
        True,
    )
    faster = [(two, one) for one, two in SLOWER]
    for pairs, higher, is_worse in (
        (SLOWER, True, False),
        (faster, True, True),
        (faster, False, False),
        (SLOWER, None, None),
    ):
        (change,) = significant_changes([sample(pairs, higher_is_better=higher)], Significance())
        assert change.is_worse is is_worse


def test_p_values_are_corrected_for_tests_that_can_be_significant() -> None:
    equal = sample([(1.0, 1.0)] * 20)
    half_equal = sample([(10.0, 10.0)] * 5 + SLOWER)
    found = significant_changes([sample(SLOWER), equal, half_equal], Significance())
    assert [change.p for change in found] == pytest.approx([2 * 2 / 2**8] * 2)
    crowd = [sample([(1.0, 1.0), (1.0, 1.01)]) for _ in range(6)]
    assert not significant_changes([sample(SLOWER), *crowd], Significance())  # 7 tests: 0.055


def test_alpha_and_smallest_effect_are_inclusive_limits() -> None:
    p, effect = 2 / 2**8, (12.5 - 10.35) / 10.35
    assert significant_changes([sample(SLOWER)], Significance(alpha=p, min_effect=0.0))
    assert not significant_changes([sample(SLOWER)], Significance(alpha=p * 0.999, min_effect=0.0))
    assert significant_changes([sample(SLOWER)], Significance(min_effect=effect * 0.999))
    assert not significant_changes([sample(SLOWER)], Significance(min_effect=effect * 1.001))
    doubled = [(1.0, 2.0)] * 8
    assert significant_changes([sample(doubled)], Significance(min_effect=1.0))
    negative = [(-one, -two) for one, two in SLOWER]
    assert significant_changes([sample(negative)], Significance())
    assert not significant_changes([sample(negative)], Significance(min_effect=effect * 1.001))
