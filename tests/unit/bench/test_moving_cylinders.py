"""Tests of generated fields of moving cylinders."""

import numpy as np
import pytest

from simscen.bench.navigation.moving_cylinders import (
    ARENA_HALF_WIDTH_M,
    MAX_SPEED_DEVIATION_M_S,
    MOVER_COUNT_RANGE,
    SPEEDS_M_S,
    DynamicField,
    generate_dynamic_field,
)


@pytest.fixture(scope="module")
def fields() -> list[DynamicField]:
    """Return twenty fields of each speed."""
    return [generate_dynamic_field(number, speed) for speed in SPEEDS_M_S for number in range(1, 21)]


def test_number_and_speed_determine_the_field() -> None:
    for a, b in zip(generate_dynamic_field(3, 1.23).movers, generate_dynamic_field(3, 1.23).movers, strict=True):
        assert np.array_equal(a.points, b.points) and np.array_equal(a.times, b.times) and a.phase == b.phase
    assert generate_dynamic_field(3, 1.23).movers[0].phase != generate_dynamic_field(4, 1.23).movers[0].phase


def test_there_are_5_to_24_cylinders_and_both_ends_occur(fields: list[DynamicField]) -> None:
    counts = [len(field.movers) for field in fields]
    assert MOVER_COUNT_RANGE[0] <= min(counts) < 8 and 21 < max(counts) <= MOVER_COUNT_RANGE[1]


def test_cylinders_stay_in_the_arena_and_start_at_different_points_of_their_paths(fields: list[DynamicField]) -> None:
    for field in fields:
        for mover in field.movers:
            assert np.abs(mover.points).max() <= ARENA_HALF_WIDTH_M + 1e-9
            assert 0 <= mover.phase < 2 * mover.times[-1]


@pytest.mark.parametrize("speed", SPEEDS_M_S)
def test_the_mean_speed_is_as_requested_and_no_segment_is_much_faster_or_slower(
    speed: float, fields: list[DynamicField]
) -> None:
    mean_speeds = []
    for field in (field for field in fields if field.speed == speed):
        for mover in field.movers:
            speeds = np.hypot(*np.diff(mover.points, axis=0).T) / np.diff(mover.times)
            assert (
                speed - 2 * MAX_SPEED_DEVIATION_M_S - 1e-9 <= speeds.min()
                and speeds.max() <= speed + 2 * MAX_SPEED_DEVIATION_M_S + 1e-9
            )
            mean_speeds.append(float(speeds.mean()))
    assert np.mean(mean_speeds) == pytest.approx(speed, abs=0.04)


def test_cylinders_move_along_both_axes(fields: list[DynamicField]) -> None:
    spans = [np.ptp(mover.points, axis=0) for field in fields for mover in field.movers]
    wide_count = sum(bool(span[0] > span[1]) for span in spans)
    assert 0.25 < wide_count / len(spans) < 0.75
