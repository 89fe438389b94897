"""Gaps of a drive: times at which the pose of the robot is unknown, and times at which no message was recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive, Scans, TimedValues

MIN_GAP_S, MIN_GAP_PERIODS = 1.0, 5.0
"""Minimum time between two poses that is a gap: the larger of a time and a multiple of the period of the poses."""
MAX_EXTRAPOLATION_S = 0.25
"""Maximum time before the first pose and after the last pose in which the pose counts as known."""
MAX_STANDING_CHANGE_M_RAD = 0.05
"""Maximum change of the pose in a gap, in m and rad, of a robot that stands."""
MIN_RECORDING_GAP_S, MIN_RECORDING_GAP_PERIODS = 0.5, 10.0
"""Minimum time without any message that is a gap: the larger of a time and a multiple of the median time between two
messages of any topic."""

Gaps = Sequence[tuple[float, float]]
"""Start and end of each gap in s."""


def pose_gaps(drive: RecordedDrive) -> Gaps:
    """Return the gaps in which the pose of the robot is unknown.

    The pose is known while the robot stands. If AMCL is the only source of poses, the pose is always known, because
    AMCL publishes a pose whenever the robot has moved.
    """
    times = drive.poses.times
    if not drive.has_true_poses and not len(drive.odometry):
        return []
    indices = np.flatnonzero(np.diff(times) > max(MIN_GAP_S, MIN_GAP_PERIODS * drive.poses.period))
    gaps = list(zip(times[indices].tolist(), times[indices + 1].tolist(), strict=True))
    first, last = float(times[0]) - MAX_EXTRAPOLATION_S, float(times[-1]) + MAX_EXTRAPOLATION_S
    if first > 0.0:
        gaps.insert(0, (0.0, first))
    if last < drive.duration:
        gaps.append((last, drive.duration))
    return [gap for gap in gaps if not _is_standing(drive, *gap)]


def pose_is_known(drive: RecordedDrive, times: Array) -> Mask:
    """Return a mask (n,) of the `times` (n,) in s at which the pose of the robot is known."""
    is_known = np.ones(len(times), dtype=bool)
    for begin, end in pose_gaps(drive):
        is_known &= (times < begin) | (times > end)
    return is_known


def scans_with_pose(drive: RecordedDrive, scans: Scans) -> Scans:
    """Return the scans that were measured while the pose of the robot was known."""
    return scans.subset(pose_is_known(drive, scans.times))


def belief_with_pose(drive: RecordedDrive) -> TimedValues:
    """Return the belief of a drive without the samples at times at which the pose of the robot is unknown."""
    is_known, belief = pose_is_known(drive, drive.belief.times), drive.belief
    return TimedValues(belief.times[is_known], belief.values[is_known], belief.arrivals[is_known])


def recording_gaps(drive: RecordedDrive) -> Gaps:
    """Return the gaps in which the recorder lost the messages of all topics.

    The result is empty for a log with a single topic, because such a log does not show whether the recorder or the
    sensor was interrupted.
    """
    signals = (drive.poses, drive.odometry, drive.commands, drive.turn_rates, drive.belief, drive.scans)
    # Signals with equal log times are from the same topic.
    topics = {signal.arrivals.tobytes(): signal.arrivals for signal in signals if signal is not None and len(signal)}
    if len(topics) < 2:
        return []
    arrivals = np.sort(np.concatenate([*topics.values()]))
    steps = np.diff(arrivals)
    indices = np.flatnonzero(steps > max(MIN_RECORDING_GAP_S, MIN_RECORDING_GAP_PERIODS * float(np.median(steps))))
    return list(zip(arrivals[indices].tolist(), arrivals[indices + 1].tolist(), strict=True))


def seconds_in_gaps(gaps: Gaps, begins: Array, ends: Array) -> Array:
    """Return how many seconds (n,) of the time spans from `begins` (n,) to `ends` (n,) are in gaps."""
    total = np.zeros(len(begins))
    for begin, end in gaps:
        total += np.maximum(np.minimum(ends, end) - np.maximum(begins, begin), 0.0)
    return total


def _is_standing(drive: RecordedDrive, begin: float, end: float) -> bool:
    """Return whether the robot stands between two times in s, by its poses and its odometry.

    Return False if both have fewer than two samples between these times.
    """
    changes = []
    for signal in (drive.poses, drive.odometry):
        poses = signal.values[(signal.times >= begin) & (signal.times <= end), :3]
        if len(poses) > 1:
            changes += [*np.ptp(poses[:, :2], axis=0).tolist(), float(np.ptp(np.unwrap(poses[:, 2])))]
    return bool(changes) and max(changes) <= MAX_STANDING_CHANGE_M_RAD
