"""Statistics of run results without SciPy: confidence intervals, tests, and the chi-square distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

MIN_PAIRS = 5
"""Minimum number of paired differences for a bootstrap interval."""
RESAMPLES = 10_000
"""Number of bootstrap resamples, unless MAX_DRAWS requires fewer."""
MAX_DRAWS = 20_000_000
"""Maximum number of values that a bootstrap draws. For many pairs, it uses fewer resamples: at least RESAMPLES / 10."""
CONFIDENCE = 0.95
"""Confidence level of the bootstrap interval."""
_DRAWS_PER_BATCH = 1 << 20
"""Number of values that a bootstrap draws at once."""


def bootstrap_mean_interval(
    differences: Sequence[float], rng: np.random.Generator, weights: Sequence[float] | None = None
) -> tuple[float, float] | None:
    """Return the lower and upper confidence limit of the mean of paired differences; None for fewer than MIN_PAIRS.

    `weights` contains the weight of each difference; None for equal weights. The method is the percentile bootstrap
    (Efron and Tibshirani: An Introduction to the Bootstrap, 1993, chapter 13).
    """
    if len(differences) < MIN_PAIRS:
        return None
    values = np.asarray(differences, dtype=np.float64)
    counts = np.ones(len(values)) if weights is None else np.asarray(weights, dtype=np.float64)
    values = values * counts
    resamples = max(RESAMPLES // 10, min(RESAMPLES, MAX_DRAWS // len(values)))
    rows = max(1, _DRAWS_PER_BATCH // len(values))
    draws = (
        rng.integers(0, len(values), (min(rows, resamples - done), len(values))) for done in range(0, resamples, rows)
    )
    means = np.concatenate([values[drawn].sum(axis=1) / counts[drawn].sum(axis=1) for drawn in draws])
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)


def sign_test(more: int, less: int) -> float:
    """Return the p-value of the exact two-sided sign test (Conover: Practical Nonparametric Statistics, 1999, 3.4).

    `more` is the number of pairs with an increase, and `less` the number of pairs with a decrease.
    """
    pairs, fewer = more + less, min(more, less)
    term = math.exp(
        math.lgamma(pairs + 1) - math.lgamma(fewer + 1) - math.lgamma(pairs - fewer + 1) - pairs * math.log(2.0)
    )
    tail = term
    for k in range(fewer, 0, -1):
        term *= k / (pairs - k + 1)  # from the binomial coefficient of k to that of k - 1
        tail += term
    return min(1.0, 2 * tail)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values with Holm's adjustment for multiple tests, in the same order.

    Source: Holm, A Simple Sequentially Rejective Multiple Test Procedure, 1979.
    """
    adjusted, largest = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        largest = max(largest, (len(p_values) - rank) * p_values[index])
        adjusted[index] = min(1.0, largest)
    return adjusted


Z_95 = 1.959963984540054
"""Number of standard deviations around the mean that contain 95 % of a normal distribution."""


def wilson_interval(successes: float, runs: int) -> tuple[float, float]:
    """Return the limits of the 95 % Wilson score interval of a success rate (Wilson 1927, JASA 22(158)).

    `successes` may be fractional. Raises ValueError unless 0 <= successes <= runs and runs >= 1.
    """
    if runs < 1 or not 0 <= successes <= runs:
        raise ValueError(f"{successes} successes of {runs} runs are impossible")
    rate, square = successes / runs, Z_95 * Z_95
    middle = (rate + square / (2 * runs)) / (1 + square / runs)
    half = Z_95 / (1 + square / runs) * math.sqrt(rate * (1 - rate) / runs + square / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)


def chi2_quantile(probability: float, freedom: int) -> float:
    """Return the quantile of the chi-square distribution with `freedom` degrees of freedom.

    Raises ValueError unless 0 < probability < 1 and freedom >= 1.
    """
    if not 0.0 < probability < 1.0 or freedom < 1:
        raise ValueError(f"probability {probability:g} with {freedom} degrees of freedom")
    low, high = 0.0, float(freedom)
    while chi2_cdf(high, freedom) < probability:
        high *= 2.0
    while (middle := (low + high) / 2.0) not in (low, high):
        low, high = (middle, high) if chi2_cdf(middle, freedom) < probability else (low, middle)
    return high


def chi2_cdf(value: float, freedom: int) -> float:
    """Return the chi-square distribution function at `value` > 0 for `freedom` degrees of freedom.

    The method is the power series of the incomplete gamma function (Abramowitz and Stegun 1964, 6.5.29).
    """
    a, x = freedom / 2.0, value / 2.0
    term = total = 1.0 / a
    n = a
    while term > total * 1e-17:
        n += 1.0
        term *= x / n
        total += term
    return min(1.0, total * math.exp(a * math.log(x) - x - math.lgamma(a)))


def nees_mean_bounds(samples: int, dimensions: int, probability: float) -> tuple[float, float]:
    """Return the bounds between which the mean NEES of a consistent estimator lies with this `probability`.

    NEES is the normalized estimation error squared. The mean is over `samples` independent errors with `dimensions`
    components. The bounds are two-sided quantiles of chi2(dimensions x samples) / samples (Bar-Shalom et al. 2001).
    """
    tail, freedom = (1.0 - probability) / 2.0, dimensions * samples
    return chi2_quantile(tail, freedom) / samples, chi2_quantile(1.0 - tail, freedom) / samples
