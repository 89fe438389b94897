"""Motion of a recorded drive in steps of equal duration: by odometry, by true poses, and by commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.reconstruction.drive.gaps import pose_is_known
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, TimedValues

STEP_S = 0.5
"""Duration of a motion step."""
MAX_STEP_M = 2.0
"""Maximum true motion in a step. A step with a larger motion contains a jump of the pose, and is omitted."""
MIN_JUMP_M = 0.5
"""Minimum difference between the true motion and the odometry in a step that is a jump of the pose."""
INTEGRATION_STEP_S = 0.02
"""Time step of the integration of commands."""


@dataclass(frozen=True, eq=False)
class MotionSteps:
    """Motion in steps of STEP_S. A row is forward distance in m, leftward distance in m, and turn in rad.

    Attributes:
        times: Start (n,) of each step in s.
        measured: Motion (n, 3) by odometry.
        true: Motion (n, 3) by the poses of the drive.
        commanded: Motion (n, 3) if commands are executed exactly.
    """

    times: Array
    measured: Array
    true: Array
    commanded: Array

    def __len__(self) -> int:
        return len(self.times)


def motion_steps(drive: RecordedDrive) -> MotionSteps:
    """Return the motion of a drive in the steps for which the log has odometry and poses."""
    odometry, poses = drive.odometry, drive.poses
    if len(odometry) < 2 or len(poses) < 2:
        return MotionSteps(np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
    begin = max(float(odometry.times[0]), float(poses.times[0]))
    end = min(float(odometry.times[-1]), float(poses.times[-1]))
    edges = np.arange(begin, end, STEP_S)
    if len(edges) < 2:
        return MotionSteps(np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
    measured, true = _motion_between(odometry, edges), _motion_between(poses, edges)
    commanded = _commanded_motion(drive.commands, edges)
    odometry_counts = np.diff(np.searchsorted(odometry.times, edges, side="right"))
    is_known = pose_is_known(drive, edges)
    is_kept = (np.hypot(*true[:, :2].T) < MAX_STEP_M) & (odometry_counts > 0) & is_known[:-1] & is_known[1:]
    return MotionSteps(edges[:-1][is_kept], measured[is_kept], true[is_kept], commanded[is_kept])


def true_speeds(drive: RecordedDrive) -> Array:
    """Return the speeds (n,) in m/s in the steps of `motion_steps`, from the poses of a drive.

    Steps in which the pose jumps are omitted.
    """
    steps = motion_steps(drive)
    true, measured = (np.hypot(*motion[:, :2].T) for motion in (steps.true, steps.measured))
    speeds: Array = true[true < measured + MIN_JUMP_M] / STEP_S
    return speeds


def _motion_between(poses: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between the times `edges` (n,), in the frame of the mean heading of each step."""
    edge_poses = poses.poses_at(edges)
    turn = wrap_array(np.diff(edge_poses[:, 2]))
    mean_heading = edge_poses[:-1, 2] + turn / 2
    dx, dy = np.diff(edge_poses[:, 0]), np.diff(edge_poses[:, 1])
    c, s = np.cos(mean_heading), np.sin(mean_heading)
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def _commanded_motion(commands: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between the times `edges` (n,) if commands are executed exactly."""
    if not len(commands):
        return np.zeros((len(edges) - 1, 3))
    times = np.arange(float(edges[0]), float(edges[-1]) + 1e-9, INTEGRATION_STEP_S)
    velocities = commands.values_at(times)
    velocities[times < commands.times[0]] = 0.0
    totals = np.vstack((np.zeros(3), np.cumsum(velocities * INTEGRATION_STEP_S, axis=0)))
    return np.diff(totals[np.minimum(np.searchsorted(times, edges), len(totals) - 1)], axis=0)
