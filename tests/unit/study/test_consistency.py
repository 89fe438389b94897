import numpy as np
import pytest
from filterpy.stats import NEES

from simscen.study.consistency import anees, bounds, nees


def test_nees_is_that_of_filterpy() -> None:
    chance = np.random.default_rng(1)
    square = chance.normal(size=(3, 3))
    covariance, error = square @ square.T + np.eye(3), chance.normal(size=3)
    expected = NEES(error[None], np.zeros((1, 3)), covariance[None])[0]
    assert nees(error, covariance) == pytest.approx(expected)


def test_a_belief_without_doubt_is_overconfident() -> None:
    assert nees(np.array([0.1, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0])) == float("inf")


@pytest.mark.parametrize(
    ("runs", "low", "high"), [(20, 2.02, 4.17), (50, 2.36, 3.72), (100, 2.54, 3.50), (1000, 2.85, 3.15)]
)
def test_the_bounds_are_those_of_the_literature(runs: int, low: float, high: float) -> None:
    assert bounds(runs) == pytest.approx((low, high), abs=0.01)


def test_a_consistent_estimator_lies_within_the_bounds() -> None:
    chance = np.random.default_rng(7)
    covariance = np.diag([0.01, 0.04, 0.001])
    values = [nees(chance.multivariate_normal(np.zeros(3), covariance), covariance) for _ in range(1000)]
    low, high = bounds(1000)
    assert low < anees(values) < high
