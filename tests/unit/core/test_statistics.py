"""Tests of paired statistics against scipy."""

import numpy as np
import pytest
from scipy import stats

from simscen.core.statistics import MIN_PAIRS, bootstrap_mean_interval, holm, sign_test


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(("more", "less"), [(0, 0), (1, 0), (5, 0), (0, 5), (7, 2), (3, 3), (40, 61), (900, 800)])
def test_the_sign_test_is_the_exact_two_sided_binomial_test(more: int, less: int) -> None:
    expected = stats.binomtest(more, more + less).pvalue if more + less else 1.0
    assert sign_test(more, less) == pytest.approx(expected, rel=1e-9)


def test_the_sign_test_of_very_many_pairs_does_not_overflow() -> None:
    assert sign_test(60_000, 40_000) == 0.0
    assert sign_test(50_000, 50_000) == 1.0
    assert sign_test(50_300, 49_700) == pytest.approx(stats.binomtest(50_300, 100_000).pvalue, rel=1e-6)


@pytest.mark.parametrize("n", [5, 12, 60])
def test_the_interval_is_scipys_percentile_bootstrap(n: int) -> None:
    """Both draw 10 000 times, each in its own way, so that they agree as far as that decides."""
    values = stats.gamma(2.0).rvs(n, random_state=n) - 1.5
    own = bootstrap_mean_interval(list(values), rng())
    theirs = stats.bootstrap((values,), np.mean, n_resamples=10_000, method="percentile", rng=rng(2))
    spread = values.std() / n**0.5
    assert own == pytest.approx(tuple(theirs.confidence_interval), abs=0.08 * spread)


def test_interval_covers_the_true_mean_at_its_confidence() -> None:
    """Of 40 pairs; a percentile bootstrap is known to be a little too narrow."""
    draws = rng(3).normal(0.4, 1.0, (300, 40))
    intervals = [bootstrap_mean_interval(row.tolist(), rng(k)) for k, row in enumerate(draws)]
    held = sum(low <= 0.4 <= high for low, high in filter(None, intervals))
    assert 0.90 <= held / 300 <= 0.98


def test_the_same_differences_give_the_same_interval_and_few_of_them_none() -> None:
    values = [0.5, 1.0, -0.25, 2.0, 0.75, 0.0]
    assert bootstrap_mean_interval(values, rng()) == bootstrap_mean_interval(values, rng())
    assert bootstrap_mean_interval(values[: MIN_PAIRS - 1], rng()) is None
    assert bootstrap_mean_interval([0.25] * 9, rng()) == (0.25, 0.25)


def test_an_interval_of_many_pairs_is_drawn_in_parts() -> None:
    low, high = bootstrap_mean_interval(rng(4).normal(1.0, 1.0, 8_000).tolist(), rng()) or (0.0, 0.0)
    assert high - low == pytest.approx(2 * 1.96 / 8_000**0.5, rel=0.1)
    assert low < 1.0 < high


def test_holm_adjusts_from_the_smallest_p_value_and_never_decreases() -> None:
    """The example in Holm (1979) has this structure; here by hand: 4 x 0.01, 3 x 0.015, then the maximum so far."""
    assert holm([0.04, 0.01, 0.03, 0.015]) == pytest.approx([0.06, 0.04, 0.06, 0.045])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []
