"""Tests of speed, acceleration, jerk, and smoothness against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.sparc_ldlj import evenly_sampled_speed
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

STEP_S = 6 / 240


def trace_with_velocity(velocity):
    """Return a trace with this recorded velocity."""
    trace = synthetic_trace({"seconds": (len(velocity) - 1) * STEP_S, "truth": [[0, 0, 0]]})
    return replace(trace, velocity=Samples(trace.truth.ticks, np.array(velocity, dtype=np.float64)))


def test_speed_is_over_ground_and_its_components_are_signed():
    trace = trace_with_velocity([[-3.0, 4.0, -0.5]] * 5)
    assert read_signal("speed", trace, synthetic_case({}), {}).tolist() == [5.0] * 5
    assert read_signal("forward_speed", trace, synthetic_case({}), {}).tolist() == [-3.0] * 5
    assert read_signal("turn_rate", trace, synthetic_case({}), {}).tolist() == [0.5] * 5
    assert read_signal("yaw_rate", trace, synthetic_case({}), {}).tolist() == [-0.5] * 5


def test_acceleration_is_divided_by_the_time_between_samples():
    """Arena's get_metrics.py divides neither acceleration nor jerk by dt."""
    trace = trace_with_velocity([[0.05 * k * k, 0, 0.1 * k] for k in range(9)])
    case = synthetic_case({})
    expected = [0.05 / STEP_S, *(0.05 * (2 * k + 1) / STEP_S for k in range(8))]
    assert read_signal("acceleration", trace, case, {}) == pytest.approx(expected)
    assert read_signal("angular_acceleration", trace, case, {}) == pytest.approx([0.1 / STEP_S] * 9)


def test_jerk_is_the_second_difference_of_speed_not_the_first():
    """HuNavSim's jerk is the first difference, divided by dt twice."""
    case = synthetic_case({})
    ramp = trace_with_velocity([[0.1 * k, 0, 0] for k in range(9)])
    assert read_signal("jerk", ramp, case, {}) == pytest.approx([0.0] * 9, abs=1e-9)
    parabola = trace_with_velocity([[-0.05 * k * k, 0, 0] for k in range(9)])
    assert read_signal("jerk", parabola, case, {}) == pytest.approx([0.1 / STEP_S**2] * 9)


def test_jerk_needs_three_samples_and_acceleration_two():
    case = synthetic_case({})
    assert len(read_signal("acceleration", trace_with_velocity([[0, 0, 0], [1, 0, 0]]), case, {})) == 2
    assert len(read_signal("jerk", trace_with_velocity([[0, 0, 0], [1, 0, 0], [1, 0, 0]]), case, {})) == 3
    with pytest.raises(MissingEvidence, match="too short: 2 samples"):
        read_signal("jerk", trace_with_velocity([[0, 0, 0], [1, 0, 0]]), case, {})
    with pytest.raises(MissingEvidence, match="too short: 1 sample of"):
        read_signal("acceleration", trace_with_velocity([[0, 0, 0]]), case, {})


def test_teleporting_causes_no_acceleration_and_no_jerk():
    trace = trace_with_velocity([[1, 0, 0]] * 4 + [[0, 0, 0]] * 4)
    carried = synthetic_trace({"seconds": 7 * STEP_S, "truth": [[0, 0, 0]], "events": [[3 * STEP_S, "robot.placed"]]})
    trace, stays = replace(trace, events=carried.events), replace(trace, events=())
    case = synthetic_case({})
    assert read_signal("acceleration", trace, case, {}).tolist() == [0.0] * 8
    assert read_signal("jerk", trace, case, {}).tolist() == [0.0] * 8
    assert np.count_nonzero(read_signal("acceleration", stays, case, {})) == 1
    assert np.count_nonzero(read_signal("jerk", stays, case, {})) == 2


@pytest.mark.parametrize(
    ("after", "still", "smooth"), [(0, [0, 1], [0, 1]), (3, [4], [3, 4]), (7, [8], [7, 8]), (8, [], []), (9, [], [])]
)
def test_only_differences_across_a_teleport_are_excluded(after, still, smooth):
    """The speeds are a parabola. The robot is kidnapped after a sample, so that the next difference is excluded."""
    trace = trace_with_velocity([[0.05 * k * k, 0, 0] for k in range(9)])
    events = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "events": [[after * STEP_S, "robot.placed"]]}).events
    trace, case = replace(trace, events=events), synthetic_case({})
    changes = np.array([0.05 / STEP_S, *(0.05 * (2 * k + 1) / STEP_S for k in range(8))])
    changes[still] = 0.0
    jerks = np.full(9, 0.1 / STEP_S**2)
    jerks[smooth] = 0.0
    assert read_signal("acceleration", trace, case, {}) == pytest.approx(changes)
    assert read_signal("jerk", trace, case, {}) == pytest.approx(jerks)


def test_teleport_before_the_first_sample_has_no_effect():
    trace = trace_with_velocity([[0, 0, 0]] * 4 + [[1, 0, 0]])
    placed = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "events": [[0, "robot.placed"]]}).events
    later = Samples(trace.truth.ticks + 240, trace.truth.values)
    trace = replace(trace, truth=later, velocity=Samples(later.ticks, trace.velocity.values), events=placed)
    assert read_signal("acceleration", trace, synthetic_case({}), {}).tolist() == [0.0] * 4 + [1.0 / STEP_S]


def trace_with_uneven_samples(ticks, speeds):
    """Return the trace of a drive along x with these speeds at these ticks of 1/240 s."""
    trace, ticks = trace_with_velocity([[speed, 0.0, 0.0] for speed in speeds]), np.array(ticks, dtype=np.int64)
    truth, velocity = (Samples(ticks, samples.values) for samples in (trace.truth, trace.velocity))
    return replace(trace, truth=truth, velocity=velocity, end=int(ticks[-1]))


def test_differences_of_uneven_samples_are_those_of_the_interpolated_signal():
    ticks = [0, 11, 25, 36, 60, 71, 84]
    steady = trace_with_uneven_samples(ticks, [tick / 240 for tick in ticks])
    assert read_signal("acceleration", steady, synthetic_case({}), {}) == pytest.approx(np.ones(7), abs=1e-9)
    assert read_signal("jerk", steady, synthetic_case({}), {}) == pytest.approx(np.zeros(7), abs=1e-9)


def test_differences_are_not_known_across_a_long_gap():
    steady = trace_with_uneven_samples([0, 12, 24, 36, 97, 108], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert read_signal("speed", steady, synthetic_case({}), {}).tolist() == [0.0] * 6
    with pytest.raises(MissingEvidence, match=r"no sample from t = 0.15 s to 0.40 s; .* need a sample every 0.25 s"):
        read_signal("acceleration", steady, synthetic_case({}), {})
    bridged = trace_with_uneven_samples([0, 12, 24, 36, 96, 108], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert read_signal("acceleration", bridged, synthetic_case({}), {}).tolist() == [0.0] * 6


def test_teleporting_causes_no_acceleration_of_uneven_samples():
    placed = Event(30, EventKind.ROBOT_PLACED, "robot")
    trace = replace(
        trace_with_uneven_samples([0, 11, 25, 36, 48, 60], [0.0, 0.0, 0.0, 2.0, 2.0, 2.0]), events=(placed,)
    )
    assert np.abs(read_signal("acceleration", trace, synthetic_case({}), {})).max() < 40.0


@pytest.mark.parametrize(("rate", "is_known"), [(18, True), (17, False)])
def test_smoothness_needs_samples_at_its_lowest_rate(rate: int, is_known: bool) -> None:
    trace = replace(synthetic_trace({"seconds": 2, "truth": [[0, 0, 0], [2, 1, 0]]}), tick_rate=rate * 10)
    ticks = np.arange(0, 200, 10)
    velocity = Samples(ticks, np.column_stack((np.linspace(0, 1, 20), np.zeros(20), np.zeros(20))))
    moved = replace(trace, truth=Samples(ticks, np.zeros((20, 3))), velocity=velocity, end=190)
    if is_known:
        assert evenly_sampled_speed(moved)[1] == rate
    else:
        with pytest.raises(MissingEvidence, match="too few"):
            evenly_sampled_speed(moved)
