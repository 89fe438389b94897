"""Tests of the share of random particles (table 8.3)."""

import numpy as np
import pytest

from simscen.stack.localizers.augmented_mcl import AugmentedMcl, RunningAverage


@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.9])
def test_a_running_average_is_the_exponentially_weighted_one(alpha: float) -> None:
    values, average = np.random.default_rng(1).random(40), RunningAverage(alpha)
    for count, value in enumerate(values, 1):
        average.add(value)
        weights = (1 - alpha) ** np.arange(count)[::-1]
        assert average.value == pytest.approx(np.average(values[:count], weights=weights))


ANYWHERE = np.log(np.linspace(0.5, 1.5, 200))
"""Likelihoods of a scan at random places: one on average."""


def test_random_particles_are_added_while_other_poses_are_likelier() -> None:
    """Long after the start the averages are those of the book."""
    recovery, slow, fast = AugmentedMcl(0.01, 0.3), 6.0, 6.0
    for _ in range(3000):
        recovery.observe(np.log(6.0), ANYWHERE)
    assert recovery.random_fraction < 1e-12
    shares = []
    for likelihood in [0.8] * 5 + [6.0] * 30:
        slow, fast = slow + 0.01 * (likelihood - slow), fast + 0.3 * (likelihood - fast)
        recovery.observe(np.log(likelihood), ANYWHERE)
        shares.append(recovery.random_fraction)
        assert recovery.random_fraction in (0.0, pytest.approx(max(0, 1 - fast / slow), abs=1e-9))
    assert shares[4] > 0.5
    assert shares[-1] == 0


def test_scan_that_fits_nowhere_adds_no_random_particles() -> None:
    recovery = AugmentedMcl(0.001, 0.1)
    for hard in [1.0] * 50 + [1e-3] * 50:
        recovery.observe(np.log(6.0 * hard), ANYWHERE + np.log(hard))
        assert recovery.random_fraction < 1e-12


def test_scan_explained_better_than_elsewhere_adds_no_random_particles() -> None:
    recovery = AugmentedMcl(0.001, 0.1)
    for likelihood in [6.0] * 50 + [2.0] * 50:
        recovery.observe(np.log(likelihood), ANYWHERE)
        assert recovery.random_fraction == 0


def test_share_of_random_particles_is_limited_by_the_sensor_model() -> None:
    free, bound = AugmentedMcl(0.001, 0.1), AugmentedMcl(0.001, 0.1, 0.01)
    for likelihood in [6.0] * 50 + [0.8] * 50:
        free.observe(np.log(likelihood), ANYWHERE)
        bound.observe(np.log(likelihood), ANYWHERE)
        assert bound.random_fraction == min(0.01, free.random_fraction)
    assert free.random_fraction > 0.5


def test_total_of_random_particles_is_limited() -> None:
    """A twentieth with each of many scans put eight of ten particles of a good cloud elsewhere within seconds."""
    recovery = AugmentedMcl(0.001, 0.1, 0.05)
    for likelihood in [6.0] * 50 + [0.8] * 50:
        recovery.observe(np.log(likelihood), ANYWHERE)
    assert recovery.random_fraction == 0.05
    assert recovery.kept_fraction(0.1) == 1.0
    assert recovery.kept_fraction(0.6) == pytest.approx(0.25)


def test_no_random_particles_with_nav2_defaults() -> None:
    assert not AugmentedMcl(0.0, 0.0).is_enabled
    assert AugmentedMcl(0.001, 0.1).is_enabled


@pytest.mark.parametrize(("tracked", "anywhere"), [(-np.inf, -np.inf), (-np.inf, 0.0), (0.0, -np.inf), (2000.0, 0.0)])
def test_random_particle_share_is_valid_for_zero_likelihoods(tracked: float, anywhere: float) -> None:
    recovery = AugmentedMcl(0.01, 0.3)
    recovery.observe(1.0, np.zeros(3))
    recovery.observe(tracked, np.full(3, anywhere))
    assert 0 <= recovery.random_fraction <= 1
