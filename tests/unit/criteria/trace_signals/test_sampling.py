"""Tests of the resampling of uneven signals, and gaps in them, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Evidence
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.trace_signals.sampling import evenly_spaced, usual_period
from simscen.criteria.trace_signals.sparc_ldlj import evenly_sampled_speed
from simscen.criteria.trace_signals.trace_checks import check_recorded_signals, time_gaps
from simscen.testing.synthetic_trace import synthetic_trace

TICK_RATE_HZ = 240


def samples(*ticks: int) -> Samples:
    """Return samples of a signal that equals twice the tick."""
    return Samples(np.array(ticks), 2.0 * np.array(ticks)[:, np.newaxis])


@pytest.mark.parametrize(
    ("ticks", "period"), [([], 1), ([5], 1), ([5, 9], 4), ([0, 1], 1), ([0, 1, 2], 1), ([0, 8, 16, 30], 8), ([3, 3], 1)]
)
def test_period_is_the_median_spacing(ticks: list[int], period: int) -> None:
    assert usual_period(np.array(ticks)) == period


def test_even_samples_are_not_resampled() -> None:
    even = samples(6, 12, 18, 24)
    assert evenly_spaced(even, TICK_RATE_HZ) is even


def test_uneven_samples_are_interpolated_from_the_first_to_the_last() -> None:
    found = evenly_spaced(samples(10, 20, 30, 41, 50), TICK_RATE_HZ)
    assert found.ticks.tolist() == [10, 20, 30, 40, 50]
    assert found.values[:, 0].tolist() == [20.0, 40.0, 60.0, 80.0, 100.0]


def test_resampling_ends_at_the_last_grid_point() -> None:
    assert evenly_spaced(samples(0, 10, 20, 29), TICK_RATE_HZ).ticks.tolist() == [0, 10, 20]
    assert evenly_spaced(samples(0, 10, 20, 31), TICK_RATE_HZ).ticks.tolist() == [0, 10, 20, 30]
    assert evenly_spaced(samples(0, 10, 20, 30, 39), TICK_RATE_HZ).ticks.tolist() == [0, 10, 20, 30]
    assert evenly_spaced(samples(0, 1, 3, 5), TICK_RATE_HZ).ticks.tolist() == [0, 2, 4]


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(MissingEvidence, match="1 sample of the truth"):
        evenly_spaced(samples(5), TICK_RATE_HZ)


@pytest.mark.parametrize("ticks", [(0, 0, 0), (0, 10, 10, 20), (0, 20, 10)])
def test_spacing_of_unordered_samples_is_undefined(ticks: tuple[int, ...]) -> None:
    with pytest.raises(MissingEvidence, match="chronological order"):
        evenly_spaced(samples(*ticks), TICK_RATE_HZ)


def with_truth_at(*ticks: int, end: int = 480):  # type: ignore[no-untyped-def]
    trace = synthetic_trace({"seconds": end / TICK_RATE_HZ, "truth": [[0, 0, 0]], "clearance": 1.0})
    truth = Samples(np.array(ticks), np.zeros((len(ticks), 6)))
    return replace(trace, truth=truth, velocity=truth)


@pytest.mark.parametrize(
    ("ticks", "gap"),
    [
        ((0, 240, 480), ""),
        ((0, 241, 480), "from t = 0.00 s to 1.00 s"),
        ((240, 480), ""),
        ((241, 480), "from t = 0.00 s to 1.00 s"),
        ((0, 100, 239), "from t = 1.00 s to 2.00 s"),
        ((0, 100, 240), ""),
    ],
)
def test_gaps_longer_than_a_second_are_reported_with_start_and_end(ticks: tuple[int, ...], gap: str) -> None:
    found = time_gaps(with_truth_at(*ticks))
    assert found.get(Evidence.TRUTH, "") == (f"the truth has no sample {gap}" if gap else "")
    assert found.get(Evidence.VELOCITY, "") == found.get(Evidence.TRUTH, "")
    assert Evidence.CLEARANCE not in found


def test_samples_one_tick_apart_are_in_order() -> None:
    check_recorded_signals(with_truth_at(0, 1, 2))


@pytest.mark.parametrize(
    ("ticks", "seconds"),
    [((0, 120, 120, 480), "0.50"), ((0, 1, 240, 120, 480), "1.00"), ((0, 120, 60, 480, 30), "0.50")],
)
def test_unordered_samples_are_refused_with_the_first_position(ticks: tuple[int, ...], seconds: str) -> None:
    with pytest.raises(InvalidTrace, match=f"not in chronological order after t = {seconds} s"):
        check_recorded_signals(with_truth_at(*ticks))


@pytest.mark.parametrize(("period", "is_enough"), [(12, True), (13, True), (14, False)])
def test_smoothness_needs_18_samples_a_second(period: int, is_enough: bool) -> None:
    """At 240 ticks a second, 13 ticks are 18.46 Hz, and 14 ticks are 17.14 Hz."""
    ticks = range(0, 480, period)
    if is_enough:
        assert evenly_sampled_speed(with_truth_at(*ticks))[1] == pytest.approx(TICK_RATE_HZ / period)
    else:
        with pytest.raises(MissingEvidence, match="too few for changes up to 10 Hz"):
            evenly_sampled_speed(with_truth_at(*ticks))
