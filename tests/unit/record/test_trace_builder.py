"""Tests of TraceBuilder, which collects the moments of a run in a trace."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moments import CLOCK, moments, sample_header

from simscen.core.geometry import Pose2, Pose3, wrap_array
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.events import Event
from simscen.core.records.trace import Decision, Moment, Trace, Truth
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder
from simscen.record.trace_difference import first_difference

RUN = list(moments(2.0))


def build_trace(run: list[Moment], end: int = 480) -> Trace:
    builder = TraceBuilder(CLOCK)
    for moment in run:
        builder.append(moment)
    return builder.finish(end)


@pytest.fixture(scope="module")
def trace() -> Trace:
    return build_trace(RUN)


def assert_poses(values: np.ndarray, expected: "list[tuple[float, ...]]") -> None:
    """Assert that positions are equal and that headings differ only by rounding."""
    rows = np.array(expected)
    assert np.array_equal(values[:, :2], rows[:, :2])
    assert np.abs(wrap_array(values[:, 2] - rows[:, 2])).max() < 1e-14


def test_truth_is_sampled_at_moments_with_truth(trace: Trace) -> None:
    truths = [(m.tick, m.truth) for m in RUN if m.truth]
    assert trace.truth.ticks.tolist() == trace.clearance.ticks.tolist() == [tick for tick, _ in truths]
    assert_poses(trace.truth.values, [truth.pose.plane for _, truth in truths])
    assert trace.velocity.values.tolist() == [list(truth.twist) for _, truth in truths]
    assert trace.clearance.values.ravel().tolist() == [truth.clearance for _, truth in truths]


def test_beliefs_carry_pose_and_upper_covariance(trace: Trace) -> None:
    beliefs = [(m.tick, m.decision.belief) for m in RUN if m.decision.belief]
    assert trace.belief.ticks.tolist() == [tick for tick, _ in beliefs]
    assert_poses(trace.belief.values, [belief.pose for _, belief in beliefs])
    upper = [belief.covariance[np.triu_indices(3)].tolist() for _, belief in beliefs]
    assert trace.belief.values[:, 3:].tolist() == upper


def test_odometry_of_the_first_sensor_is_used(trace: Trace) -> None:
    wheels = [(m.tick, r.pose) for m in RUN for r in m.readings if isinstance(r, Odometry) and r.sensor == "wheels"]
    assert trace.odometry.ticks.tolist() == [tick for tick, _ in wheels]
    assert_poses(trace.odometry.values, [pose for _, pose in wheels])


def test_command_at_any_beat_is_the_last_decision(trace: Trace) -> None:
    commands = trace.command.at(np.array([m.tick for m in RUN]))
    assert commands.tolist() == [list(m.decision.command) for m in RUN]


def test_object_pose_at_a_cycle_is_the_true_pose(trace: Trace) -> None:
    objects_by_tick = [(m.tick, m.truth.objects) for m in RUN if m.truth and m.truth.objects]
    assert list(trace.objects) == ["a box", "cart"]
    for name, samples in trace.objects.items():
        poses = samples.at(np.array([tick for tick, _ in objects_by_tick]))
        assert_poses(poses, [objects[name].plane for _, objects in objects_by_tick])


def test_scan_times_include_all_lidars(trace: Trace) -> None:
    assert trace.scans.tolist() == [m.tick for m in RUN if any(isinstance(r, Scan) for r in m.readings)]


def test_plans_keep_their_tick_and_their_points(trace: Trace) -> None:
    plans = [m.decision.plan for m in RUN if m.decision.plan]
    assert [plan.tick for plan in trace.plans] == [plan.tick for plan in plans]
    for ours, theirs in zip(trace.plans, plans, strict=True):
        assert_poses(ours.points, theirs.points.tolist())


def test_events_of_world_and_stack_are_kept_in_order() -> None:
    world, stack = Event(0, "fault.started", "lidar.off"), Event(0, "goal.accepted", "shelf", {"index": 0})
    moment = Moment(0, Truth(Pose3(), STOP, 1.0), (), Decision(STOP, events=(stack,)), (world,))
    assert build_trace([moment]).events == (world, stack)


def test_run_aborted_at_the_start_has_an_empty_trace() -> None:
    trace = build_trace([], end=0)
    assert trace.truth.values.shape == (0, 3)
    assert trace.belief.values.shape == (0, 9)
    assert len(trace.scans) == len(trace.events) == trace.end == 0


def test_odometry_is_from_the_first_sensor_of_the_robot_also_if_it_delivers_later(tmp_path: Path) -> None:
    """In the log, the first sensor has the topic /odom."""
    header = replace(sample_header(), sensors={"slow": "Odometry", "fast": "Odometry"})
    readings = [("fast", 0), ("fast", 6), ("slow", 6), ("fast", 12), ("slow", 12)]
    decision = Decision(STOP)
    with Recorder(tmp_path / "run.mcap", CLOCK, header) as recorder:
        builder = TraceBuilder(CLOCK, recorder.robots[""].thinning)
        for tick in (0, 6, 12):
            tick_readings = tuple(
                Odometry(name, tick, Pose2(1.0 if name == "slow" else 2.0, 0.0), STOP)
                for name, at in readings
                if at == tick
            )
            moment = Moment(tick, None, tick_readings, decision)
            recorder.append(moment)
            builder.append(moment)
        recorder.close(12)
    trace = builder.finish(12)
    assert (trace.odometry.ticks.tolist(), trace.odometry.values[:, 0].tolist()) == ([6, 12], [1.0, 1.0])
    assert first_difference(trace, read_log(tmp_path / "run.mcap").trace) is None
