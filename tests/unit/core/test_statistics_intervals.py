import pytest
from scipy.stats import binomtest

from simscen.core.statistics import wilson_interval


@pytest.mark.parametrize(("good", "runs"), [(0, 20), (1, 20), (10, 20), (29, 30), (20, 20), (500, 500)])
def test_the_interval_is_that_of_scipy(good: int, runs: int) -> None:
    expected = binomtest(good, runs).proportion_ci(method="wilson")
    assert wilson_interval(good, runs) == pytest.approx((expected.low, expected.high), abs=1e-12)


@pytest.mark.parametrize(("good", "runs"), [(0, 0), (3, 2), (-1, 5)])
def test_pass_rate_without_runs_is_undefined(good: int, runs: int) -> None:
    with pytest.raises(ValueError, match="successes of"):
        wilson_interval(good, runs)
