"""Tests of signals against closed forms, brute force and evo's definition of APE."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.records.trace import Samples
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.timeline import first_sustained
from simscen.criteria.trace_signals.estimation_errors import pose_error
from simscen.criteria.trace_signals.ground_truth import clearance, drive, speed, true_pose, turn_rate
from simscen.criteria.trace_signals.trace_checks import check_recorded_signals
from simscen.testing.synthetic_trace import synthetic_trace


def test_distance_along_a_circle_is_its_circumference():
    angles = np.linspace(0, 2 * math.pi, 400)
    circle = [[10 * k / 399, 2 * math.cos(a), 2 * math.sin(a), a + math.pi / 2] for k, a in enumerate(angles)]
    assert drive(synthetic_trace({"seconds": 10, "truth": circle})).length == pytest.approx(4 * math.pi, rel=1e-3)


def test_distance_driven_increases_with_time():
    way = drive(synthetic_trace({"seconds": 10, "truth": [[0, 0, 0], [10, 8, 0]]}))
    assert way.until(0) == 0.0
    assert way.until(1200) == pytest.approx(4.0, abs=0.021)
    assert way.until(10**9) == way.length == pytest.approx(8.0)


def test_pose_error_is_the_distance_at_the_moment_of_the_belief():
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0], [10, 5, 0]], "belief": {"offset": [0.03, 0.04, 0.1]}})
    error = pose_error(trace)
    assert error.values[:, 0] == pytest.approx(np.full(len(error), 0.05))
    assert error.values[:, 1] == pytest.approx(np.full(len(error), 0.1))


def test_error_of_an_outdated_belief_grows_after_one_second():
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0], [10, 5, 0]]})
    early = trace.belief.ticks <= 2 * 240
    silent = type(trace)(
        **{**vars(trace), "belief": type(trace.belief)(trace.belief.ticks[early], trace.belief.values[early])}
    )
    error = pose_error(silent)
    assert error.values[error.ticks <= 480, 0].max() == pytest.approx(0.0, abs=1e-9)
    assert error.ticks[error.ticks > 480][0] == 480 + 240 + 6
    assert error.values[-1, 0] == pytest.approx(4.0)


@given(st.lists(st.booleans(), min_size=1, max_size=30), st.integers(0, 40))
def test_first_lasting_interval_equals_brute_force(true, hold):
    ticks = np.arange(len(true), dtype=np.int64) * 3
    end = int(ticks[-1]) + 2
    expected = (None, False)
    for k in range(len(true)):
        if true[k] and (k == 0 or not true[k - 1]):
            stop = next((int(ticks[m]) for m in range(k, len(true)) if not true[m]), end)
            if stop - ticks[k] >= hold:
                expected = (int(ticks[k]), True)
                break
            if stop == end:
                expected = (int(ticks[k]), False)
    assert first_sustained(ticks, np.array(true), hold, end) == expected


def trace_of_points(xy, placed=()):
    """Return a trace with one true position (x, y) per 0.5 s; the robot is kidnapped at the times `placed` in s."""
    ticks = np.arange(len(xy), dtype=np.int64) * 120
    truth = Samples(ticks, np.column_stack((np.array(xy, dtype=np.float64), np.zeros(len(xy)))))
    events = [[t, "robot.placed"] for t in placed]
    return replace(synthetic_trace({"seconds": len(xy) / 2, "truth": [[0, 0, 0]], "events": events}), truth=truth)


def test_small_motions_accumulate():
    still = trace_of_points([(0, 0), (0.0078125, 0), (0, 0), (0, 0.0078125), (0, 0)])
    assert drive(still).length == 0.0
    creeping = drive(trace_of_points([(0.0078125 * k, 0) for k in range(9)]))
    assert creeping.length == 0.0625
    assert creeping.ticks.tolist() == [0, 240, 480, 720, 960]
    assert creeping.travelled.tolist() == [0.0, 0.015625, 0.03125, 0.046875, 0.0625]


def test_a_move_of_exactly_a_centimeter_counts():
    assert drive(trace_of_points([(0, 0), (0.01, 0)])).length == 0.01
    assert drive(trace_of_points([(0, 1), (0, 1.5)])).length == 0.5


def test_teleport_is_not_driven_but_the_motion_after_it_is():
    way = drive(trace_of_points([(0, 0), (1, 0), (9, 9), (9, 10)], placed=[0.5]))
    assert way.length == 2.0
    assert way.travelled.tolist() == [0.0, 1.0, 1.0, 2.0]
    assert drive(trace_of_points([(0, 0), (1, 0), (9, 9), (9, 10)])).length > 12


def test_distance_driven_at_a_time_is_that_of_the_samples_before():
    way = drive(trace_of_points([(0, 0), (1, 0), (2, 0)]))
    assert [way.until(tick) for tick in (-1, 0, 119, 120, 239, 240, 9999)] == [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0]


def test_empty_trace_has_no_distance():
    trace = trace_of_points([(0, 0)])
    empty = replace(trace, truth=Samples(trace.truth.ticks[:0], trace.truth.values[:0]))
    way, error = drive(empty), pose_error(empty)
    assert (way.length, way.until(9), len(way.ticks), len(way.travelled)) == (0.0, 0.0, 0, 0)
    assert (len(error), error.values.shape) == (0, (0, 2))
    assert len(pose_error(replace(trace, belief=Samples(trace.truth.ticks[:0], np.empty((0, 9)))))) == 0


def test_speed_is_over_ground_and_turn_rate_is_unsigned():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    trace.velocity.values[3] = (-3.0, 4.0, -2.0)
    assert (speed(trace).values[3, 0], turn_rate(trace).values[3, 0]) == (5.0, 2.0)
    assert speed(trace).values.shape == turn_rate(trace).values.shape == (41, 1)


@pytest.mark.parametrize(("column", "value"), [(0, np.nan), (1, np.inf), (2, -np.inf)])
def test_nonfinite_signal_is_reported_with_its_first_time(column, value):
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0]]})
    trace.truth.values[[80, 120], column] = value
    with pytest.raises(InvalidTrace, match=r"the true pose is not finite at t = 2\.00 s"):
        drive(trace)


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_nan_clearance_is_reported_with_its_first_time(value):
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0]]})
    trace.clearance.values[[80, 120]] = value
    with pytest.raises(InvalidTrace, match=r"the clearance is not a number at t = 2\.00 s"):
        clearance(trace)
    trace.clearance.values[:] = np.inf
    assert clearance(trace) is trace.clearance


def test_first_object_with_a_nonfinite_pose_is_named():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    lost = Samples(trace.truth.ticks, np.full((41, 3), np.nan))
    with pytest.raises(InvalidTrace, match=r"the pose of cart is not finite at t = 0\.00 s"):
        check_recorded_signals(replace(trace, objects={"door": lost, "cart": lost}))


def test_the_true_pose_at_a_tick_is_the_newest_sample():
    trace = trace_of_points([(0, 0), (1, 0), (2, 0)])
    assert [true_pose(trace, tick).x for tick in (0, 119, 120, 500)] == [0.0, 0.0, 1.0, 2.0]


def test_heading_error_between_samples_is_wrapped():
    words = {"seconds": 2, "truth": [[0, 0, 0, 3.1], [2, 0, 0, 3.2]], "belief": [[0, 0, 0, -3.1], [2, 0, 0, -3.0]]}
    assert pose_error(synthetic_trace(words)).values[:, 1] == pytest.approx(np.full(21, 2 * math.pi - 6.2))


def test_error_is_measured_against_the_truth_at_the_same_time():
    ticks = np.array([0, 240], dtype=np.int64)
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "belief": [[0, 1, 1, 3.2]]})
    rare = replace(trace, truth=Samples(ticks, np.array([[0.0, 0.0, 3.0], [4.0, 8.0, 3.4 - 2 * math.pi]])))
    error = pose_error(rare)
    assert error.ticks[5] == 120
    assert error.values[5] == pytest.approx([math.hypot(1 - 2, 1 - 4), 0.0])


def test_each_belief_is_valid_for_one_second():
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 4, 0]]})
    few = np.array([240, 720])
    error = pose_error(replace(trace, belief=Samples(few, trace.belief.at(few))))
    assert error.ticks.tolist() == [240, *range(486, 720, 6), 720]
    assert pose_error(replace(trace, belief=Samples(few[1:], trace.belief.at(few[1:])))).ticks.tolist() == [720]
