"""Tests of the bounds that the average NEES of a consistent estimator keeps."""

import numpy as np
import pytest

from simscen.bench.localization.consistency import anees_bounds, correlated_anees_bounds, fraction_in_ellipsoid
from simscen.core.geometry import Array
from simscen.criteria.trace_signals.estimation_errors import nees


@pytest.mark.parametrize(
    ("runs", "low", "high"), [(20, 2.02, 4.17), (50, 2.36, 3.72), (100, 2.54, 3.50), (1000, 2.85, 3.15)]
)
def test_bounds_equal_those_of_the_literature(runs: int, low: float, high: float) -> None:
    assert anees_bounds(runs) == pytest.approx((low, high), abs=0.01)


def test_a_consistent_estimator_lies_within_the_bounds() -> None:
    rng = np.random.default_rng(7)
    errors = rng.multivariate_normal(np.zeros(3), np.diag([0.01, 0.04, 0.001]), 1000)
    values = nees(errors, np.tile([0.01, 0.0, 0.0, 0.04, 0.0, 0.001], (1000, 1)))
    low, high = anees_bounds(1000)
    assert low < np.mean(values) < high


def filter_nees(rng: np.random.Generator, campaigns: int, buildings: int, shared: float) -> Array:
    """Return the NEES (campaigns, buildings, 25) of a Kalman filter of a random walk, in five logs at five times each.

    A measurement has an independent error (variance 4), and an error that all measurements in its building share
    (variance `shared`). The filter knows both variances. The times are four steps apart, so that errors in a log are
    correlated, too.
    """
    walk, noise = 0.25, 4.0
    predicted_variance = (walk + np.sqrt(walk**2 + 4 * walk * noise)) / 2  # steady state of the Riccati equation
    gain = predicted_variance / (predicted_variance + noise)
    variance = (1 - gain) * predicted_variance + shared
    error = np.sqrt(variance - shared) * rng.standard_normal((campaigns, buildings, 5, 3))
    shared_error = np.sqrt(shared) * rng.standard_normal((campaigns, buildings, 1, 3))
    values = []
    for step in range(20):
        predicted_error = error + np.sqrt(walk) * rng.standard_normal(error.shape)
        error = (1 - gain) * predicted_error + gain * np.sqrt(noise) * rng.standard_normal(error.shape)
        if step % 4 == 3:
            values.append(np.square(error + shared_error).sum(axis=-1) / variance)
    return np.stack(values, axis=-1).reshape(campaigns, buildings, 25)


@pytest.mark.parametrize("shared", [0.0, 0.3])
def test_bounds_over_buildings_contain_only_a_consistent_filter(shared: float) -> None:
    """An inconsistent filter, whose standard deviations are 1.5 times too small or too large, is outside the bounds."""
    values = filter_nees(np.random.default_rng(3), 400, 8, shared)

    def share_within_bounds(factor: float) -> float:
        campaigns = (values * factor).mean(axis=2)
        limits = [correlated_anees_bounds(campaign.tolist()) for campaign in campaigns]
        return float(
            np.mean([low < campaign.mean() < high for campaign, (low, high) in zip(campaigns, limits, strict=True)])
        )

    assert 0.92 < share_within_bounds(1.0) < 0.98
    assert share_within_bounds(1.5**2) < 0.03
    assert share_within_bounds(1.5**-2) < 0.03


def test_independent_bounds_are_too_narrow_for_correlated_logs() -> None:
    values = filter_nees(np.random.default_rng(3), 400, 8, 0.3)
    low, high = anees_bounds(8 * 25)
    means = values.mean(axis=(1, 2))
    assert np.mean((low < means) & (means < high)) < 0.85


def test_two_buildings_give_no_bounds() -> None:
    assert correlated_anees_bounds([2.0, 4.0]) is None
    assert correlated_anees_bounds([2.0, 4.0, float("inf")]) is None


def test_bounds_over_buildings_are_those_of_students_t_for_the_logarithm() -> None:
    low, high = correlated_anees_bounds([2.0, 3.0, 4.0]) or (0.0, 0.0)
    assert np.log((low / 3.0, high / 3.0)) == pytest.approx((-0.8281, 0.8281), abs=1e-3)  # 4.3027 / (3 √3)


def test_poses_in_the_ellipsoid_are_counted() -> None:
    assert fraction_in_ellipsoid([7.8, 7.83, 1.0, 30.0]) == 0.5
