"""Tests of first_pose_difference, which compares runs on different machines with a tolerance."""

import dataclasses
import math

import pytest
from moments import CLOCK, moments

from simscen.core.records.trace import Samples, Trace
from simscen.record.trace_builder import TraceBuilder
from simscen.record.trace_difference import first_pose_difference


@pytest.fixture
def trace() -> Trace:
    builder = TraceBuilder(CLOCK)
    for moment in moments(1.0):
        builder.append(moment)
    return builder.finish(240)


def with_moved_pose(trace: Trace, column: int, offset: float) -> Trace:
    values = trace.truth.values.copy()
    values[4, column] += offset
    return dataclasses.replace(trace, truth=Samples(trace.truth.ticks, values))


@pytest.mark.parametrize(("column", "offset"), [(0, 0.0), (0, 1e-12), (1, -9e-6), (2, 9e-6), (2, 2 * math.pi)])
def test_runs_that_differ_by_rounding_are_equal(trace: Trace, column: int, offset: float) -> None:
    assert first_pose_difference(trace, with_moved_pose(trace, column, offset)) is None


@pytest.mark.parametrize(("column", "offset"), [(0, 1.1e-5), (1, -1.0), (2, 1e-4), (0, math.nan)])
def test_different_path_is_reported_with_its_tick(trace: Trace, column: int, offset: float) -> None:
    assert "tick 24 (t = 0.100 s): the true pose differs by" in str(
        first_pose_difference(trace, with_moved_pose(trace, column, offset))
    )


def test_different_end_is_reported(trace: Trace) -> None:
    assert first_pose_difference(trace, dataclasses.replace(trace, end=241)) == "the runs end at ticks 240 and 241"
    assert "tick rate" in str(first_pose_difference(trace, dataclasses.replace(trace, tick_rate=100)))


def test_missing_poses_are_reported(trace: Trace) -> None:
    count = len(trace.truth)
    empty = dataclasses.replace(trace, truth=Samples(trace.truth.ticks[:0], trace.truth.values[:0]))
    assert first_pose_difference(trace, empty) == f"the traces have {count} and 0 true poses"
