"""Tests of drives whose ground truth has gaps or jumps, or a low rate."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.gaps import pose_gaps
from simscen.reconstruction.drive.motion_steps import motion_steps
from simscen.reconstruction.drive.recorded_drive import TimedValues, no_values
from simscen.reconstruction.estimators import run_estimators
from simscen.reconstruction.scenario.incidents import find_incidents
from simscen.reconstruction.static_world import map_from_scans


def without_poses(drive, begin, end):
    """Return the drive without true poses from `begin` to `end` in s."""
    kept = (drive.poses.times <= begin) | (drive.poses.times >= end)
    poses = TimedValues(drive.poses.times[kept], drive.poses.values[kept], drive.poses.arrivals[kept])
    return replace(drive, poses=poses)


@pytest.mark.parametrize(("begin", "end"), [(4.0, 7.0), (9.0, 13.0), (-1.0, 2.0)])
def test_a_gap_in_the_ground_truth_shows_no_objects_and_faults(begin, end):
    drive = without_poses(drives.drive(drives.scans()), begin, end)
    parts = run_estimators(drive, drives.room())
    assert (parts.objects, parts.faults, parts.kidnaps, parts.incidents) == ([], [], [], [])
    (gap,) = pose_gaps(drive)
    assert gap == (pytest.approx(max(begin, 0.0), abs=0.3), pytest.approx(min(end, drives.DURATION_S), abs=0.3))
    assert any(f"where the robot was from t = {gap[0]:.2f} s" in unknown for unknown in parts.unknowns)


def test_a_gap_of_the_recorder_is_no_outage_of_the_sensors():
    drive = drives.drive(drives.scans())

    def without_gap(signal):
        kept = (signal.times < 5.0) | (signal.times > 7.2)
        return TimedValues(signal.times[kept], signal.values[kept], signal.arrivals[kept])

    names = ("poses", "odometry", "commands", "turn_rates", "belief")
    kept = (drive.scans.times < 5.0) | (drive.scans.times > 7.2)
    with_gap = replace(
        drive, scans=drive.scans.subset(kept), **{name: without_gap(getattr(drive, name)) for name in names}
    )
    parts = run_estimators(with_gap, drives.room())
    assert (parts.objects, parts.faults) == ([], [])
    assert any("what happened from t = 4.9" in unknown for unknown in parts.unknowns)
    only_lidar = run_estimators(replace(drive, scans=with_gap.scans), drives.room())
    assert [(fault.target, fault.kind) for fault in only_lidar.faults] == [("lidar", "off")]


def test_a_map_is_not_built_from_scans_without_a_pose():
    drive = without_poses(drives.drive(drives.scans()), 4.0, 7.0)
    grid = map_from_scans(drive)
    occupied = grid.center_of(np.argwhere(grid.cells == 100))
    assert float(np.percentile(drives.room().distance_to_walls(occupied), 99)) < 0.1


def test_a_gap_in_which_the_robot_stands_is_no_gap():
    times = np.arange(0.0, drives.DURATION_S, 0.1)
    standing = drives.signal(times, np.tile([1.0, 3.0, 0.0, 0.0, 0.0, 0.0], (len(times), 1)))
    poses = drives.signal(times, standing.values[:, :3])
    assert pose_gaps(without_poses(drives.drive(poses=poses, odometry=standing), 4.0, 7.0)) == []
    turned = standing.values.copy()
    turned[50:, 2] = 1.0
    turning = drives.signal(times, turned)
    assert len(pose_gaps(without_poses(drives.drive(poses=poses, odometry=turning), 4.0, 7.0))) == 1


def test_poses_of_amcl_alone_have_no_gaps():
    drive = without_poses(drives.drive(odometry=no_values(6), has_true_poses=False), 4.0, 7.0)
    assert pose_gaps(drive) == []


def test_a_belief_in_a_gap_of_the_ground_truth_is_not_lost():
    """The robot turns around in the gap, so that the interpolated path is wrong."""
    times = np.arange(0.0, drives.DURATION_S, 0.1)
    x = 1.0 + np.abs(times - 5.0)
    values = np.column_stack((x, np.full(len(x), 3.0), np.zeros(len(x))))
    belief = drives.signal(times, np.column_stack((values, np.full((len(x), 6), 0.01))))
    odometry = drives.signal(times, np.column_stack((values, np.zeros((len(x), 3)))))
    drive = drives.drive(poses=drives.signal(times, values), belief=belief, odometry=odometry)
    assert find_incidents(without_poses(drive, 3.0, 7.0)) == []
    assert len(motion_steps(without_poses(drive, 3.0, 7.0))) < len(motion_steps(drive)) - 6


@pytest.mark.parametrize("rate", [3.5, 4.0, 20.0])
def test_a_fast_robot_with_a_rare_ground_truth_is_not_kidnapped(rate):
    times = np.arange(0.0, 12.0, 1 / rate)
    times = np.delete(times, [30, 31, 32, 33, 34]) if rate == 20.0 else times
    positions = np.column_stack((2.5 * times, np.zeros((len(times), 2))))
    assert run_estimators(drives.drive(poses=drives.signal(times, positions)), drives.room()).kidnaps == []
    positions[len(positions) // 2 :, 1] += 1.0
    ((time, pose, _),) = run_estimators(drives.drive(poses=drives.signal(times, positions)), drives.room()).kidnaps
    assert (time, pose) == (times[len(positions) // 2], Pose2(*positions[len(positions) // 2].tolist()))
