"""Tests of the clock: periods, ticks, and nanoseconds."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.clock import Clock


@pytest.mark.parametrize(("hertz", "ticks"), [(240, 1), (40, 6), (10, 24), (1, 240), (0.5, 480)])
def test_a_rate_that_divides_the_clock_has_a_whole_period(hertz, ticks):
    assert Clock(240).period(hertz) == ticks


@pytest.mark.parametrize(("hertz", "nearest"), [(50, "48"), (7, "6.85714|6"), (300, "240")])
def test_a_rate_that_does_not_divide_the_clock_is_refused_with_the_nearest_that_does(hertz, nearest):
    with pytest.raises(ValueError, match=f"nearest that does is ({nearest})"):
        Clock(240).period(hertz)


def test_ticks_and_seconds_are_inverse():
    clock = Clock(240)
    assert all(clock.ticks(clock.seconds(tick)) == tick for tick in range(100_000))


rates = st.integers(1, 999_999_999)
ticks = st.integers(0, 10**12)


@given(rates, ticks)
def test_every_tick_is_read_back_from_its_nanoseconds(rate: int, tick: int) -> None:
    clock = Clock(rate)
    assert clock.tick_at(clock.nanoseconds(tick)) == tick


@given(rates, ticks)
def test_nanoseconds_are_the_exact_time_rounded_down(rate: int, tick: int) -> None:
    exact = Fraction(tick, rate) * 10**9
    assert 0 <= exact - Clock(rate).nanoseconds(tick) < 1


@given(rates, ticks)
def test_a_stamp_is_the_same_time_in_seconds_and_nanoseconds(rate: int, tick: int) -> None:
    sec, nanosec = Clock(rate).stamp(tick)
    assert 0 <= nanosec < 10**9
    assert sec * 10**9 + nanosec == Clock(rate).nanoseconds(tick)


@pytest.mark.parametrize("rate", [0, -1, 10**9])
def test_tick_rate_above_nanosecond_resolution_is_refused(rate: int) -> None:
    with pytest.raises(ValueError, match="must be in 1 … 999,999,999 Hz"):
        Clock(rate)
