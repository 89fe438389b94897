"""Tests of the search for the first difference between two runs."""

import dataclasses

import numpy as np
import pytest
from moments import CLOCK, moments

from simscen.core.messages.navigation import Path
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples, Trace
from simscen.record.trace_builder import TraceBuilder
from simscen.record.trace_difference import first_difference


@pytest.fixture
def trace() -> Trace:
    builder = TraceBuilder(CLOCK)
    for moment in moments(1.0):
        builder.append(moment)
    return builder.finish(240)


def with_offset(samples: Samples, row: int, column: int, by: float) -> Samples:
    values = samples.values.copy()
    values[row, column] += by
    return Samples(samples.ticks, values)


def test_trace_does_not_differ_from_itself(trace: Trace) -> None:
    assert first_difference(trace, trace) is None


def test_difference_of_one_bit_is_found_with_tick_and_field(trace: Trace) -> None:
    values = trace.truth.values.copy()
    values[4, 1] = np.nextafter(values[4, 1], 9)
    other = dataclasses.replace(trace, truth=Samples(trace.truth.ticks, values))
    first_value, second_value = float(trace.truth.values[4, 1]), float(values[4, 1])
    assert first_difference(trace, other) == f"tick 24 (t = 0.100 s): truth.y: {first_value!r} against {second_value!r}"


def test_the_earliest_difference_is_reported(trace: Trace) -> None:
    other = dataclasses.replace(
        trace, truth=with_offset(trace.truth, 9, 0, 1.0), odometry=with_offset(trace.odometry, 3, 2, 1.0)
    )
    assert (first_difference(trace, other) or "").startswith("tick 18 (t = 0.075 s): odometry.yaw: ")


def test_at_the_same_tick_the_cause_is_reported(trace: Trace) -> None:
    other = dataclasses.replace(
        trace, truth=with_offset(trace.truth, 4, 2, 1.0), belief=with_offset(trace.belief, 1, 0, 1.0)
    )
    assert "truth.yaw" in (first_difference(trace, other) or "")


def test_nan_does_not_differ_from_nan(trace: Trace) -> None:
    with_nan = dataclasses.replace(trace, odometry=with_offset(trace.odometry, 2, 0, float("nan")))
    assert first_difference(with_nan, with_nan) is None


@pytest.mark.parametrize(
    ("tick", "points", "expected"),
    [
        (1, 3, "tick 0 (t = 0.000 s): plan: at tick 0 against 1"),
        (0, 4, "tick 0 (t = 0.000 s): plan: 3 against 4 poses"),
        (0, 3, "tick 0 (t = 0.000 s): plan: the 3 poses differ"),
    ],
)
def test_difference_of_plans_states_what_differs(trace: Trace, tick: int, points: int, expected: str) -> None:
    first = dataclasses.replace(trace, plans=(Path(np.zeros((3, 3)), 0),))
    second = dataclasses.replace(trace, plans=(Path(np.ones((points, 3)), tick),))
    assert first_difference(first, second) == expected


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("scans", np.array([0, 24, 72]), "tick 48 (t = 0.200 s): scan: at tick 48 against 72"),
        ("events", (), "tick 0 (t = 0.000 s): event: 2 against 0"),
        ("events", (Event(0, "a", "b"),) * 2, "tick 0 (t = 0.000 s): event: goal.accepted shelf against a b"),
        (
            "events",
            (Event(0, EventKind.GOAL_ACCEPTED, "shelf", {"index": 9}),) * 2,
            "tick 0 (t = 0.000 s): event: goal.accepted shelf: tick 0 {'index': 0, 'list': [1, 2.5, None, True]} "
            "against tick 0 {'index': 9}",
        ),
        ("plans", (), "tick 0 (t = 0.000 s): plan: 2 against 0"),
        ("objects", {}, "tick 0 (t = 0.000 s): object a box: 2 against 0"),
        ("end", 200, "tick 200 (t = 0.833 s): end of the run: tick 240 against 200"),
        ("tick_rate", 120, "tick rate: 240 against 120 Hz"),
    ],
)
def test_missing_values_are_reported_as_differences(trace: Trace, name: str, value: object, expected: str) -> None:
    assert first_difference(trace, dataclasses.replace(trace, **{name: value})) == expected


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (2, 2, "tick 0 (t = 0.000 s): belief: 9 against 3 columns"),
        (2, 0, "tick 0 (t = 0.000 s): belief: 2 against 0"),
        (0, 0, None),
    ],
)
def test_beliefs_with_and_without_covariance_differ(trace: Trace, first: int, second: int, expected: str) -> None:
    with_covariance = Samples(np.arange(first), np.zeros((first, 9)))
    without = Samples(np.arange(second), np.zeros((second, 3)))
    traces = (dataclasses.replace(trace, belief=belief) for belief in (with_covariance, without))
    assert first_difference(*traces) == expected
