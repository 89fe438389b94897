"""What two treatments of the same cases say about each other: nothing but their differences counts, pair by pair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

FEWEST = 5
"""Pairs below which no interval is given: a bootstrap of four sees too little of what could have happened."""
RESAMPLES = 10_000
COVERAGE = 0.95
_AT_ONCE = 1 << 20


def mean_interval(differences: Sequence[float], chance: np.random.Generator) -> tuple[float, float] | None:
    """Between what bounds the mean difference lies with 95 %; None for fewer than FEWEST pairs.

    The percentile interval of the bootstrap: pairs are drawn anew, with replacement, RESAMPLES times. (Efron and
    Tibshirani: An Introduction to the Bootstrap, 1993, chapter 13.)
    """
    if len(differences) < FEWEST:
        return None
    values = np.asarray(differences, dtype=np.float64)
    rows = max(1, _AT_ONCE // len(values))
    means = np.concatenate(
        [
            values[chance.integers(0, len(values), (min(rows, RESAMPLES - done), len(values)))].mean(axis=1)
            for done in range(0, RESAMPLES, rows)
        ]
    )
    low, high = np.quantile(means, [(1 - COVERAGE) / 2, (1 + COVERAGE) / 2])
    return float(low), float(high)


def sign_test(more: int, less: int) -> float:
    """How likely a split at least as uneven as `more` to `less` is when either is as likely: 0 … 1.

    Exact and two-sided; pairs without a difference are not counted. On passes that became failures and the other way
    round it is McNemar's exact test. (Conover: Practical Nonparametric Statistics, 1999, section 3.4.)
    """
    pairs = more + less
    tail = sum(math.comb(pairs, k) for k in range(min(more, less) + 1))
    return min(1.0, float(Fraction(2 * tail, 1 << pairs)))
