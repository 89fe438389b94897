"""Tests of pose errors in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples
from simscen.judge.metrics.trajectory import pose_metrics
from simscen.testing.synthetic_trace import synthetic_trace


def trace_with_belief(ticks, true_poses, belief_ticks, believed_poses):
    """Return a trace with these poses (x, y, yaw) of truth, and of belief with the variance of 1 in each."""
    trace = synthetic_trace({"seconds": max(ticks) / 240, "truth": [[0, 0, 0]]})
    beliefs = np.array([[*pose, 1, 0, 0, 1, 0, 1] for pose in believed_poses], dtype=np.float64)
    truth = Samples(np.array(ticks), np.array(true_poses, dtype=np.float64))
    return replace(trace, truth=truth, belief=Samples(np.array(belief_ticks), beliefs))


def test_relative_errors_are_over_consecutive_meters():
    steps = [0.5, 0.4375, 0.0625] * 3
    ways = np.concatenate(([0.0], np.cumsum(steps)))
    believed_poses = np.add(ways, [0, 5, 7, 0.2, -9, 8, 0.1, 6, -5, 0.5])
    ticks = [6 * k for k in range(len(ways))]
    metrics = pose_metrics(
        trace_with_belief(ticks, [(x, 0, 0) for x in ways], ticks, [(x, 0, 0) for x in believed_poses])
    )
    assert metrics["rpe_trans_mean"] == pytest.approx((0.2 + 0.1 + 0.4) / 3)
    assert metrics["rpe_trans_median"] == pytest.approx(0.2)
    assert metrics["rpe_trans_max"] == pytest.approx(0.4)
    assert metrics["rpe_trans_rmse"] == pytest.approx(((0.04 + 0.01 + 0.16) / 3) ** 0.5)
    assert metrics["rpe_rot_max"] == 0.0
    assert metrics["ape_trans_final"] == pytest.approx(0.5)


def test_relative_errors_do_not_cover_a_teleportation():
    ticks = [6 * k for k in range(6)]
    true_poses = [(x, 0, 0) for x in (0, 1, 1.5, 9.5, 10.375, 10.5)]  # placed between the samples at 1.5 m and 9.5 m
    believed_poses = [(x, 0, 0) for x in (0, 1.1, 1.6, 1.7, 2.7, 2.7)]
    trace = trace_with_belief(ticks, true_poses, ticks, believed_poses)
    kidnapped = replace(trace, events=(Event(12, EventKind.ROBOT_PLACED), *trace.events))
    assert pose_metrics(kidnapped)["rpe_trans_mean"] == pytest.approx((0.1 + 0.0) / 2)
    assert pose_metrics(trace)["rpe_trans_max"] == pytest.approx(7.9)


@pytest.mark.parametrize(
    ("ticks", "errors", "median", "mean"),
    [
        ([0, 6], [1, 3], 2.0, 2.0),
        ([0, 6, 12], [1, 3, 8], 3.0, 4.0),
        ([0, 6, 12, 36], [1, 2, 5, 9], 3.5, 4.25),
    ],
)
def test_absolute_errors_of_all_beliefs_count_equally(ticks, errors, median, mean):
    metrics = pose_metrics(trace_with_belief(ticks, [(0, 0, 0)] * len(ticks), ticks, [(x, 0, 0) for x in errors]))
    assert (metrics["ape_trans_median"], metrics["ape_trans_mean"]) == (median, pytest.approx(mean))


def test_old_beliefs_count_at_the_usual_rate_of_beliefs():
    """The robot publishes ten beliefs a second, but none between 1 s and 61 s, which are old from 2 s on."""
    ticks = range(0, 71 * 240, 6)
    beliefs = [*range(0, 241, 24), *range(61 * 240, 71 * 240, 24)]
    trace = trace_with_belief(
        [*ticks], [(0, 0, 0)] * len(ticks), beliefs, [(float(tick > 240), 0, 0) for tick in beliefs]
    )
    old = 59 * 40  # samples of the truth, each with a quarter of the weight of a belief
    metrics = pose_metrics(trace)
    assert metrics["ape_trans_mean"] == pytest.approx(100 / (11 + old / 4 + 100), rel=0.01)
    assert metrics["ape_trans_rmse"] == pytest.approx((100 / (11 + old / 4 + 100)) ** 0.5, rel=0.01)
    assert metrics["ape_trans_median"] == 0.0


def test_a_single_belief_counts_as_one_belief_per_second():
    ticks = [*range(0, 11 * 240, 6)]
    trace = trace_with_belief(ticks, [(float(tick >= 6 * 240), 0, 0) for tick in ticks], [0], [(0, 0, 0)])
    old = np.array([tick for tick in ticks if tick > 240])  # each has 1/40 of the weight of the belief
    expected = (old >= 6 * 240).sum() / 40 / (1 + len(old) / 40)
    assert pose_metrics(trace)["ape_trans_mean"] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("truth_period", "beliefs", "weight"),
    [(6, [0, 24], 0.25), (480, [*range(0, 241, 24)], 1.0)],
    ids=["two beliefs", "truth less often than beliefs"],
)
def test_weight_of_old_beliefs_is_the_ratio_of_the_periods_but_at_most_one(truth_period, beliefs, weight):
    ticks = [*range(0, 4801, truth_period)]
    trace = trace_with_belief(ticks, [(float(tick > 600), 0, 0) for tick in ticks], beliefs, [(0, 0, 0)] * len(beliefs))
    old = np.array([tick for tick in ticks if tick > beliefs[-1] + 240])
    expected = (old > 600).sum() * weight / (len(beliefs) + len(old) * weight)
    assert pose_metrics(trace)["ape_trans_mean"] == pytest.approx(expected)


def test_turning_in_place_adds_no_distance():
    ticks = [0, 6, 12]
    poses = [(0, 0, 0), (0.1, 0, 3.0), (0.2, 0, 0)]
    assert (
        pose_metrics(trace_with_belief(ticks, poses, ticks, poses))["rpe_trans_max"] == "the robot drove less than 1 m"
    )


def test_true_heading_is_interpolated_along_the_shorter_arc():
    true_poses = [(0, 0, 0), (0.5, 0, 0), (1.0, 0, 3.1), (1.5, 0, 2 * np.pi - 3.1 - 2 * np.pi)]
    metrics = pose_metrics(trace_with_belief([0, 6, 12, 18], true_poses, [0, 15], [(0, 0, 0), (1.25, 0, np.pi - 0.1)]))
    assert metrics["rpe_rot_max"] == pytest.approx(0.1)
    assert metrics["rpe_trans_max"] == pytest.approx(0.0)


def test_relative_errors_are_in_the_frame_of_the_robot():
    quarter = np.pi / 2
    true_poses = [(2, 3, 0.0), (2, 4, quarter)]
    believed_poses = [(5, 5, quarter), (4, 5, 2 * quarter + 0.2)]
    metrics = pose_metrics(trace_with_belief([0, 6], true_poses, [0, 6], believed_poses))
    assert metrics["rpe_trans_max"] == pytest.approx(0.0)
    assert metrics["rpe_rot_max"] == pytest.approx(0.2)


def test_belief_without_covariance_has_no_nees_with_a_reason():
    trace = trace_with_belief([0, 6], [(0, 0, 0)] * 2, [0, 6], [(0, 0, 0)] * 2)
    bare = replace(trace, belief=Samples(trace.belief.ticks, trace.belief.values[:, :3]))
    assert pose_metrics(bare)["nees"] == "the belief has no covariance"
    assert pose_metrics(trace)["nees"] == 0.0
