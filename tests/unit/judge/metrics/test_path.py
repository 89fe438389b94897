"""Tests of path shape metrics in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Samples
from simscen.criteria.trace_signals.ground_truth import drive
from simscen.judge.metrics.trajectory import path_metrics, path_segments
from simscen.testing.synthetic_trace import synthetic_trace

SAMPLE_PERIOD_TICKS = 6
CORNER = [(5, 7), (6, 7), (6, 8)]


def trace_of(points, events=(), plans=()):
    """Return a trace with the robot at one of the points (x, y) or (x, y, yaw) at each of its samples."""
    poses = np.array([[*point, 0.0][:3] for point in points], dtype=np.float64)
    trace = synthetic_trace(
        {"seconds": SAMPLE_PERIOD_TICKS * (len(poses) - 1) / 240, "truth": [[0, 0, 0]], "events": list(events)}
    )
    return replace(trace, truth=Samples(trace.truth.ticks, poses), plans=tuple(plans))


def metrics_of(*points, **trace_options):
    trace = trace_of(points, **trace_options)
    return path_metrics(trace, drive(trace))


def kidnapping(sample):
    """Return the event of a kidnapping between the samples `sample - 1` and `sample`."""
    return [[SAMPLE_PERIOD_TICKS * (sample - 1) / 240, "robot.placed"]]


def acceptance(sample=0, name="a"):
    return [SAMPLE_PERIOD_TICKS * sample / 240, "goal.accepted", name]


@pytest.mark.parametrize("side", [1, -1])
def test_path_with_a_right_angle_has_the_computed_metrics(side):
    metrics = metrics_of((5, 7), (6, 7), (6, 7 + side, side * math.pi / 2))
    assert metrics["max_curvature"] == pytest.approx(math.sqrt(2))
    assert metrics["norm_curvature"] == pytest.approx(2 * math.sqrt(2))
    assert metrics["aol"] == pytest.approx(math.pi / 4)
    assert metrics["heading_change"] == pytest.approx(math.pi / 2)


def test_the_curvature_is_one_over_the_radius_of_the_circle_through_three_points():
    middle, radius, angles = np.array([3.0, -1.0]), 2.5, (0.1, 0.9, 2.3)
    points = [middle + radius * np.array([math.cos(a), math.sin(a)]) for a in angles]
    chords = 2 * radius * (math.sin(0.4) + math.sin(0.7))
    metrics = metrics_of(*points)
    assert metrics["max_curvature"] == pytest.approx(1 / radius)
    assert metrics["norm_curvature"] == pytest.approx(chords / radius)


def test_sum_and_maximum_of_curvature_are_reported():
    metrics = metrics_of((0, 0), (1, 0), (1, 1), (3, 1))
    assert metrics["max_curvature"] == pytest.approx(math.sqrt(2))
    assert metrics["norm_curvature"] == pytest.approx(2 * math.sqrt(2) + 3 * 2 / math.sqrt(5))
    assert metrics["aol"] == pytest.approx(math.pi / 4)


def test_curvature_uses_points_at_least_30_cm_apart():
    assert metrics_of((0, 0), (0.3, 0), (0.3, 0.3))["max_curvature"] == pytest.approx(math.sqrt(2) / 0.3)
    shaky = metrics_of((5, 7), (5.2, 7.1), (5.4, 7), (5.4, 7.2), (5.4, 7.4), (5.41, 7.41))
    assert shaky["max_curvature"] == pytest.approx(math.sqrt(2) / 0.4)
    short = metrics_of((0, 0), (0.3, 0), (0.3, 0.29))
    assert (
        short["max_curvature"]
        == short["norm_curvature"]
        == "the path is too short: it has fewer than three points 0.3 m apart"
    )


def test_curvature_is_computed_for_each_path_segment():
    events = kidnapping(3)
    metrics = metrics_of(*CORNER, (0, 0), (2, 0), (2, 2), events=events)
    assert metrics["max_curvature"] == pytest.approx(math.sqrt(2))
    assert metrics["norm_curvature"] == pytest.approx(4 * math.sqrt(2))
    assert metrics["aol"] == pytest.approx(math.pi / 6)
    straight = metrics_of(*CORNER, (0, 0), (2, 0), events=events)
    assert straight["norm_curvature"] == pytest.approx(2 * math.sqrt(2))
    assert straight["aol"] == pytest.approx(math.pi / 2 / 4)


def test_kidnapping_splits_the_path_into_segments():
    trace = trace_of([*CORNER, (0, 0), (2, 0), (4, 4)], [*kidnapping(3), *kidnapping(5)])
    assert [leg.tolist() for leg in path_segments(trace, drive(trace))] == [
        [[5, 7], [6, 7], [6, 8]],
        [[0, 0], [2, 0]],
        [[4, 4]],
    ]


def test_path_with_steps_of_an_eighth_of_a_meter_is_one_segment():
    metrics = metrics_of((0, 0), (0.125, 0), (0.125, 0.125))
    assert metrics["aol"] == pytest.approx(math.pi / 2 / 0.25)


def test_path_metrics_need_the_true_pose():
    trace = replace(
        synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), truth=Samples(np.empty(0, np.int64), np.empty((0, 3)))
    )
    metrics = path_metrics(trace, drive(trace))
    assert metrics["aol"] == "the robot never drove"
    assert metrics["heading_change"] == 0.0
    assert "path is too short" in metrics["max_curvature"]


@pytest.mark.parametrize(("before", "turned"), [(1, 0.6), (2, 0.5), (3, 0.3), (4, 0.7)])
def test_rotation_by_kidnapping_is_no_heading_change(before, turned):
    yaws = [(0, 0, 0), (0, 0, 0.1), (0, 0, 0.3), (0, 0, 0.7)]
    assert metrics_of(*yaws, events=kidnapping(before))["heading_change"] == pytest.approx(turned)


def test_kidnapping_before_the_first_sample_has_no_effect():
    trace = trace_of([(0, 0, 0), (0, 0, 0.1), (0, 0, 0.3)], [[0, "robot.placed"]])
    late = replace(trace, truth=Samples(trace.truth.ticks + 1, trace.truth.values))
    assert path_metrics(late, drive(late))["heading_change"] == pytest.approx(0.3)


def plan(sample, *yaws):
    return Path(np.array([[0.0, 0.0, yaw] for yaw in yaws]), SAMPLE_PERIOD_TICKS * sample)


def test_irregularity_subtracts_the_first_plan_after_each_acceptance():
    spun = [(0, 0, 0.0), (0, 0, 1.0), (0, 0, 2.0), (0, 0, 3.0)]
    plans = [plan(0, 0, 0.9), plan(1, 0, -0.5), plan(1, 0, 0.1), plan(2, 0, 0.25, 0.0)]
    assert metrics_of(*spun, events=[acceptance(1)], plans=plans)["path_irregularity"] == pytest.approx(2.5)
    both = metrics_of(*spun, events=[acceptance(1), acceptance(2, "b")], plans=plans)
    assert both["path_irregularity"] == pytest.approx(2.0)
    assert metrics_of(*spun, events=[acceptance(0)], plans=[plan(0, 0, 2, 0, 2)])["path_irregularity"] == 0.0


def test_irregularity_is_undefined_without_a_plan_for_each_goal():
    reason = "no goal was accepted, or a goal has no plan to compare with"
    assert metrics_of(*CORNER, plans=[plan(0, 0, 1)])["path_irregularity"] == reason
    twice = [acceptance(0), acceptance(2, "b")]
    assert metrics_of(*CORNER, events=twice, plans=[plan(1, 0, 1)])["path_irregularity"] == reason
