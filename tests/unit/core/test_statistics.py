"""Tests of paired statistics against scipy."""

import numpy as np
import pytest
from scipy import stats

from simscen.core.statistics import MIN_PAIRS, bootstrap_mean_interval, holm, sign_test


def generator(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("positive", "negative"), [(0, 0), (1, 0), (5, 0), (0, 5), (7, 2), (3, 3), (40, 61), (900, 800)]
)
def test_the_sign_test_is_the_exact_two_sided_binomial_test(positive: int, negative: int) -> None:
    expected = stats.binomtest(positive, positive + negative).pvalue if positive + negative else 1.0
    assert sign_test(positive, negative) == pytest.approx(expected, rel=1e-9)


def test_the_sign_test_of_very_many_pairs_does_not_overflow() -> None:
    assert sign_test(60_000, 40_000) == 0.0
    assert sign_test(50_000, 50_000) == 1.0
    assert sign_test(50_300, 49_700) == pytest.approx(stats.binomtest(50_300, 100_000).pvalue, rel=1e-6)


@pytest.mark.parametrize("n", [5, 12, 60])
def test_the_interval_is_scipys_percentile_bootstrap(n: int) -> None:
    """Both intervals are based on 10 000 random resamples, so that they agree only approximately."""
    values = stats.gamma(2.0).rvs(n, random_state=n) - 1.5
    interval = bootstrap_mean_interval(list(values), generator())
    expected = stats.bootstrap((values,), np.mean, n_resamples=10_000, method="percentile", rng=generator(2))
    spread = values.std() / n**0.5
    assert interval == pytest.approx(tuple(expected.confidence_interval), abs=0.08 * spread)


def test_interval_covers_the_true_mean_at_its_confidence() -> None:
    """For 40 pairs, the interval of a percentile bootstrap is a little too narrow."""
    draws = generator(3).normal(0.4, 1.0, (300, 40))
    intervals = [bootstrap_mean_interval(row.tolist(), generator(k)) for k, row in enumerate(draws)]
    covering_count = sum(low <= 0.4 <= high for low, high in filter(None, intervals))
    assert 0.90 <= covering_count / 300 <= 0.98


def test_equal_differences_have_equal_intervals_and_few_differences_have_none() -> None:
    values = [0.5, 1.0, -0.25, 2.0, 0.75, 0.0]
    assert bootstrap_mean_interval(values, generator()) == bootstrap_mean_interval(values, generator())
    assert bootstrap_mean_interval(values[: MIN_PAIRS - 1], generator()) is None
    assert bootstrap_mean_interval([0.25] * 9, generator()) == (0.25, 0.25)


def test_an_interval_of_many_pairs_is_drawn_in_parts() -> None:
    low, high = bootstrap_mean_interval(generator(4).normal(1.0, 1.0, 8_000).tolist(), generator()) or (0.0, 0.0)
    assert high - low == pytest.approx(2 * 1.96 / 8_000**0.5, rel=0.1)
    assert low < 1.0 < high


def test_holm_adjusts_from_the_smallest_p_value_and_never_decreases() -> None:
    """As in the example of Holm (1979): 4 x 0.01, 3 x 0.015, then the maximum so far."""
    assert holm([0.04, 0.01, 0.03, 0.015]) == pytest.approx([0.06, 0.04, 0.06, 0.045])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []
