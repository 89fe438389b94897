"""Statistics without scipy: bootstrap and sign test, Wilson interval, chi-square quantiles.

scipy takes half a second to import.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

MIN_PAIRS = 5
"""Pairs below which no interval is given: a bootstrap of four sees too little of what could have happened."""
RESAMPLES = 10_000
MAX_DRAWS = 20_000_000
"""Pairs drawn in all before there are fewer resamples, but never fewer than a tenth: thousands of pairs need fewer."""
CONFIDENCE = 0.95
_LN_2 = math.log(2.0)
_DRAWS_PER_BATCH = 1 << 20


def bootstrap_mean_interval(
    differences: Sequence[float], chance: np.random.Generator, weights: Sequence[float] | None = None
) -> tuple[float, float] | None:
    """Between what bounds the mean difference, or the weighted one, lies with 95 %; None for fewer than FEWEST pairs.

    The percentile interval of the bootstrap: pairs are drawn anew, with replacement, RESAMPLES times. (Efron and
    Tibshirani: An Introduction to the Bootstrap, 1993, chapter 13.)
    """
    if len(differences) < MIN_PAIRS:
        return None
    values = np.asarray(differences, dtype=np.float64)
    counts = np.ones(len(values)) if weights is None else np.asarray(weights, dtype=np.float64)
    values = values * counts
    resamples = max(RESAMPLES // 10, min(RESAMPLES, MAX_DRAWS // len(values)))
    rows = max(1, _DRAWS_PER_BATCH // len(values))
    draws = (
        chance.integers(0, len(values), (min(rows, resamples - done), len(values)))
        for done in range(0, resamples, rows)
    )
    means = np.concatenate([values[drawn].sum(axis=1) / counts[drawn].sum(axis=1) for drawn in draws])
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)


def sign_test(more: int, less: int) -> float:
    """How likely a split at least as uneven as `more` to `less` is when either is as likely: 0 … 1.

    Exact and two-sided; pairs without a difference are not counted. On passes that became failures and the other way
    round it is McNemar's exact test. (Conover: Practical Nonparametric Statistics, 1999, section 3.4.)
    """
    pairs, fewer = more + less, min(more, less)
    term = math.exp(math.lgamma(pairs + 1) - math.lgamma(fewer + 1) - math.lgamma(pairs - fewer + 1) - pairs * _LN_2)
    tail = term
    for k in range(fewer, 0, -1):
        term *= k / (pairs - k + 1)  # from the ways to choose k of the pairs to those to choose k - 1
        tail += term
    return min(1.0, 2 * tail)


Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson_interval(successes: float, runs: int, z: float = Z_95) -> tuple[float, float]:
    """The score interval of a proportion: what the true rate may be after `successes` of `runs`.

    Right also at 0 and at all of the runs, where the usual interval has no width. (Wilson 1927, JASA 22(158).)
    Half a success is one of two runs that count for one together. Raises ValueError without runs.
    """
    if runs < 1 or not 0 <= successes <= runs:
        raise ValueError(f"{successes} successes of {runs} runs")
    rate, square = successes / runs, z * z
    middle = (rate + square / (2 * runs)) / (1 + square / runs)
    half = z / (1 + square / runs) * math.sqrt(rate * (1 - rate) / runs + square / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)


def chi2_quantile(probability: float, freedom: int) -> float:
    """The value that a chi-square variable of `freedom` degrees stays below with this probability.

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
    """The probability of staying below a value > 0: the regularized incomplete gamma function P(freedom/2, value/2).

    Its power series, whose terms are all positive (Abramowitz and Stegun 1964, 6.5.29).
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
    """Between which the mean of so many squared errors lies with this probability, each a sum of `dimensions` squares.

    chi2(dimensions x samples) / samples, two-sided: what a consistent estimator's NEES keeps (Bar-Shalom et al. 2001).
    """
    tail, freedom = (1.0 - probability) / 2.0, dimensions * samples
    return chi2_quantile(tail, freedom) / samples, chi2_quantile(1.0 - tail, freedom) / samples
