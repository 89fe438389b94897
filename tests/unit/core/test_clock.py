import pytest

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
