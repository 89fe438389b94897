"""What two treatments of the same cases say about each other: nothing but their differences counts, pair by pair."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

FEWEST = 5
"""Pairs below which no interval is given: a bootstrap of four sees too little of what could have happened."""
RESAMPLES = 10_000
DRAWS = 20_000_000
"""Pairs drawn in all before there are fewer resamples, but never fewer than a tenth: thousands of pairs need fewer."""
COVERAGE = 0.95
_LN_2 = math.log(2.0)
_AT_ONCE = 1 << 20


def mean_interval(
    differences: Sequence[float], chance: np.random.Generator, weights: Sequence[float] | None = None
) -> tuple[float, float] | None:
    """Between what bounds the mean difference, or the weighted one, lies with 95 %; None for fewer than FEWEST pairs.

    The percentile interval of the bootstrap: pairs are drawn anew, with replacement, RESAMPLES times. (Efron and
    Tibshirani: An Introduction to the Bootstrap, 1993, chapter 13.)
    """
    if len(differences) < FEWEST:
        return None
    values = np.asarray(differences, dtype=np.float64)
    counts = np.ones(len(values)) if weights is None else np.asarray(weights, dtype=np.float64)
    values = values * counts
    resamples = max(RESAMPLES // 10, min(RESAMPLES, DRAWS // len(values)))
    rows = max(1, _AT_ONCE // len(values))
    draws = (
        chance.integers(0, len(values), (min(rows, resamples - done), len(values)))
        for done in range(0, resamples, rows)
    )
    means = np.concatenate([values[drawn].sum(axis=1) / counts[drawn].sum(axis=1) for drawn in draws])
    low, high = np.quantile(means, [(1 - COVERAGE) / 2, (1 + COVERAGE) / 2])
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
