"""Tests of the share of random particles in Augmented MCL (Table 8.3 of Probabilistic Robotics)."""

import numpy as np
import pytest

from simscen.stack.localizers.augmented_mcl import AugmentedMcl, RunningAverage


@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.9])
def test_running_average_is_exponentially_weighted(alpha: float) -> None:
    values, average = np.random.default_rng(1).random(40), RunningAverage(alpha)
    for count, value in enumerate(values, 1):
        average.add(value)
        weights = (1 - alpha) ** np.arange(count)[::-1]
        assert average.value == pytest.approx(np.average(values[:count], weights=weights))


RANDOM_LOG_LIKELIHOODS = np.log(np.linspace(0.5, 1.5, 200))
"""Log-likelihoods of a scan at random poses; the mean likelihood is 1."""


def test_random_particles_are_added_while_other_poses_are_likelier() -> None:
    """After many scans, the averages equal those of the book."""
    recovery, slow, fast = AugmentedMcl(0.01, 0.3), 6.0, 6.0
    for _ in range(3000):
        recovery.observe(np.log(6.0), RANDOM_LOG_LIKELIHOODS)
    assert recovery.random_fraction < 1e-12
    shares = []
    for likelihood in [0.8] * 5 + [6.0] * 30:
        slow, fast = slow + 0.01 * (likelihood - slow), fast + 0.3 * (likelihood - fast)
        recovery.observe(np.log(likelihood), RANDOM_LOG_LIKELIHOODS)
        shares.append(recovery.random_fraction)
        assert recovery.random_fraction in (0.0, pytest.approx(max(0, 1 - fast / slow), abs=1e-9))
    assert shares[4] > 0.5
    assert shares[-1] == 0


def test_scan_that_fits_nowhere_adds_no_random_particles() -> None:
    recovery = AugmentedMcl(0.001, 0.1)
    for factor in [1.0] * 50 + [1e-3] * 50:
        recovery.observe(np.log(6.0 * factor), RANDOM_LOG_LIKELIHOODS + np.log(factor))
        assert recovery.random_fraction < 1e-12


def test_scan_explained_better_than_elsewhere_adds_no_random_particles() -> None:
    recovery = AugmentedMcl(0.001, 0.1)
    for likelihood in [6.0] * 50 + [2.0] * 50:
        recovery.observe(np.log(likelihood), RANDOM_LOG_LIKELIHOODS)
        assert recovery.random_fraction == 0


def test_share_of_random_particles_is_limited_by_the_sensor_model() -> None:
    unlimited, limited = AugmentedMcl(0.001, 0.1), AugmentedMcl(0.001, 0.1, 0.01)
    for likelihood in [6.0] * 50 + [0.8] * 50:
        unlimited.observe(np.log(likelihood), RANDOM_LOG_LIKELIHOODS)
        limited.observe(np.log(likelihood), RANDOM_LOG_LIKELIHOODS)
        assert limited.random_fraction == min(0.01, unlimited.random_fraction)
    assert unlimited.random_fraction > 0.5


def test_total_of_random_particles_is_limited() -> None:
    """A share of 5 % with each scan would replace 80 % of good particles within seconds."""
    recovery = AugmentedMcl(0.001, 0.1, 0.05)
    for likelihood in [6.0] * 50 + [0.8] * 50:
        recovery.observe(np.log(likelihood), RANDOM_LOG_LIKELIHOODS)
    assert recovery.random_fraction == 0.05
    assert recovery.kept_fraction(0.1) == 1.0
    assert recovery.kept_fraction(0.6) == pytest.approx(0.25)


def test_no_random_particles_with_nav2_defaults() -> None:
    assert not AugmentedMcl(0.0, 0.0).is_enabled
    assert AugmentedMcl(0.001, 0.1).is_enabled


@pytest.mark.parametrize(("current", "random"), [(-np.inf, -np.inf), (-np.inf, 0.0), (0.0, -np.inf), (2000.0, 0.0)])
def test_random_particle_share_is_valid_for_zero_likelihoods(current: float, random: float) -> None:
    recovery = AugmentedMcl(0.01, 0.3)
    recovery.observe(1.0, np.zeros(3))
    recovery.observe(current, np.full(3, random))
    assert 0 <= recovery.random_fraction <= 1
