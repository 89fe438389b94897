"""The share of random particles is that of table 8.3, with averages that are honest from the start."""

import numpy as np
import pytest

from simscen.stack.localizers.recovery import Recovery, RunningAverage


@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.9])
def test_a_running_average_is_the_exponentially_weighted_one(alpha: float) -> None:
    values, average = np.random.default_rng(1).random(40), RunningAverage(alpha)
    for count, value in enumerate(values, 1):
        average.add(value)
        weights = (1 - alpha) ** np.arange(count)[::-1]
        assert average.value == pytest.approx(np.average(values[:count], weights=weights))


def test_a_drop_of_the_likelihood_asks_for_random_particles_until_it_is_made_up() -> None:
    """Long after the start the averages are those of the book."""
    recovery, slow, fast = Recovery(0.01, 0.3), 6.0, 6.0
    for _ in range(3000):
        recovery.observe(6.0)
    assert recovery.share < 1e-12
    for likelihood in [2.0] * 5 + [6.0] * 30:
        slow, fast = slow + 0.01 * (likelihood - slow), fast + 0.3 * (likelihood - fast)
        recovery.observe(likelihood)
        assert recovery.share == pytest.approx(max(0, 1 - fast / slow), abs=1e-9)
    assert recovery.share == 0


def test_a_lucky_first_scan_is_soon_forgotten() -> None:
    recovery = Recovery(0.001, 0.1)
    for likelihood in [8.0] + [5.0] * 30:
        recovery.observe(likelihood)
    assert recovery.share < 0.03


def test_with_nav2s_default_of_zero_there_are_none() -> None:
    recovery = Recovery(0.0, 0.0)
    for likelihood in (6.0, 1.0, 0.0):
        recovery.observe(likelihood)
        assert recovery.share == 0


def test_a_scan_that_nothing_explains_at_the_very_start_is_no_reason_to_divide_by_zero() -> None:
    recovery = Recovery(0.01, 0.3)
    recovery.observe(0.0)
    assert recovery.share == 0
