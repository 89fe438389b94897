"""Motion of a drive in short steps, as the odometry reports it, as it was, and as it was commanded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, TimedValues

STEP_S = 0.5
"""Duration of a step."""
MAX_STEP_M = 2.0
"""Longer steps are jumps of the pose, not motion."""


@dataclass(frozen=True, eq=False)
class MotionSteps:
    """Steps of STEP_S that begin at `times` (n,): forward and leftward distance in m, and turn in rad, each (n, 3)."""

    times: Array
    measured: Array
    true: Array
    commanded: Array

    def __len__(self) -> int:
        return len(self.times)


def motion_steps(drive: RecordedDrive) -> MotionSteps:
    """Return the steps of a drive in which odometry and poses are known."""
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
    kept = (np.hypot(*true[:, :2].T) < MAX_STEP_M) & (count > 0)
    return MotionSteps(edges[:-1][kept], measured[kept], true[kept], commanded[kept])


def _increments(poses: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between poses at `edges` (n,), in the frame in the middle of each step."""
    at = poses.poses_at(edges)
    turn = wrap_array(np.diff(at[:, 2]))
    middle = at[:-1, 2] + turn / 2
    dx, dy = np.diff(at[:, 0]), np.diff(at[:, 1])
    c, s = np.cos(middle), np.sin(middle)
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def _commanded(commands: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) that held commands make between `edges` (n,)."""
    if not len(commands):
        return np.zeros((len(edges) - 1, 3))
    fine = np.arange(float(edges[0]), float(edges[-1]) + 1e-9, 0.02)
    values = commands.values_at(fine)
    values[fine < commands.times[0]] = 0.0
    totals = np.vstack((np.zeros(3), np.cumsum(values * 0.02, axis=0)))
    return np.diff(totals[np.minimum(np.searchsorted(fine, edges), len(totals) - 1)], axis=0)
