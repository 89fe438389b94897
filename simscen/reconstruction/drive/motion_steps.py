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
"""Maximum true motion in a step. Steps with a larger motion, a jump of the pose, are omitted."""
MIN_JUMP_M = 0.5
"""Minimum excess of the true motion in a step over the odometry that is a jump of the pose."""


@dataclass(frozen=True, eq=False)
class MotionSteps:
    """Motion in steps of STEP_S that begin at `times` (n,) in s.

    `measured` is the motion by odometry, `true` the motion by the poses of the drive, and `commanded` the motion if the
    commands are executed exactly. Rows (n, 3) are forward distance in m, leftward distance in m, and turn in rad.
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
    measured, true = _increments(odometry, edges), _increments(poses, edges)
    commanded = _commanded(drive.commands, edges)
    newest = np.searchsorted(odometry.times, edges[1:], side="right")
    count = newest - np.searchsorted(odometry.times, edges[:-1], side="right")
    known = pose_is_known(drive, edges)
    kept = (np.hypot(*true[:, :2].T) < MAX_STEP_M) & (count > 0) & known[:-1] & known[1:]
    return MotionSteps(edges[:-1][kept], measured[kept], true[kept], commanded[kept])


def true_speeds(drive: RecordedDrive) -> Array:
    """Return the speeds (n,) in m/s in the steps of `motion_steps`, from the poses of a drive without their jumps."""
    steps = motion_steps(drive)
    true, measured = (np.hypot(*motion[:, :2].T) for motion in (steps.true, steps.measured))
    speeds: Array = true[true < measured + MIN_JUMP_M] / STEP_S
    return speeds


def _increments(poses: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between the times `edges` (n,), in the frame of the mean heading of each step."""
    at = poses.poses_at(edges)
    turn = wrap_array(np.diff(at[:, 2]))
    middle = at[:-1, 2] + turn / 2
    dx, dy = np.diff(at[:, 0]), np.diff(at[:, 1])
    c, s = np.cos(middle), np.sin(middle)
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def _commanded(commands: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between the times `edges` (n,) by exact execution of the commands."""
    if not len(commands):
        return np.zeros((len(edges) - 1, 3))
    fine = np.arange(float(edges[0]), float(edges[-1]) + 1e-9, 0.02)
    values = commands.values_at(fine)
    values[fine < commands.times[0]] = 0.0
    totals = np.vstack((np.zeros(3), np.cumsum(values * 0.02, axis=0)))
    return np.diff(totals[np.minimum(np.searchsorted(fine, edges), len(totals) - 1)], axis=0)
