"""The share of random particles is that of table 8.3."""

import pytest

from simscen.stack.localizers.recovery import Recovery


def test_a_drop_of_the_likelihood_asks_for_random_particles_until_it_is_made_up() -> None:
    recovery, slow, fast = Recovery(0.01, 0.3), 6.0, 6.0
    recovery.observe(6.0)
    assert recovery.share == 0
    for likelihood in [2.0] * 5 + [6.0] * 30:
        slow, fast = slow + 0.01 * (likelihood - slow), fast + 0.3 * (likelihood - fast)
        recovery.observe(likelihood)
        assert recovery.share == pytest.approx(max(0, 1 - fast / slow))
    assert recovery.share == 0


def test_with_nav2s_default_of_zero_there_are_none() -> None:
    recovery = Recovery(0.0, 0.0)
    for likelihood in (6.0, 1.0, 0.0):
        recovery.observe(likelihood)
        assert recovery.share == 0


def test_a_scan_that_nothing_explains_at_the_very_start_is_no_reason_to_divide_by_zero() -> None:
    recovery = Recovery(0.01, 0.3)
    recovery.observe(0.0)
    assert recovery.share == 0
