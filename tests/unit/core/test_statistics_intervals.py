"""Tests of the Wilson interval against scipy."""

import pytest
from scipy.stats import binomtest

from simscen.core.statistics import wilson_interval


@pytest.mark.parametrize(("successes", "runs"), [(0, 20), (1, 20), (10, 20), (29, 30), (20, 20), (500, 500)])
def test_interval_equals_that_of_scipy(successes: int, runs: int) -> None:
    expected = binomtest(successes, runs).proportion_ci(method="wilson")
    assert wilson_interval(successes, runs) == pytest.approx((expected.low, expected.high), abs=1e-12)


@pytest.mark.parametrize(("successes", "runs"), [(0, 0), (3, 2), (-1, 5)])
def test_interval_of_impossible_counts_is_refused(successes: int, runs: int) -> None:
    with pytest.raises(ValueError, match="successes of"):
        wilson_interval(successes, runs)
