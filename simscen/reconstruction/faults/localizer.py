"""Finds faults of the localizer: outages, and jumps of the estimated pose."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap, wrap_array
from simscen.reconstruction.drive.gaps import belief_with_pose, recording_gaps, seconds_in_gaps
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive
from simscen.reconstruction.reasons import FoundFault, Reason, find_windows

MIN_JUMP_M, MIN_JUMP_RAD = 0.2, math.radians(10)
"""Minimum change of the error of position or heading, from one estimate to the next estimate, that counts as a jump."""
MIN_OUTAGE_S, MIN_OUTAGE_PERIODS = 1.0, 6.0
"""Minimum duration of a reported outage: the larger of a time and a multiple of the period of the estimates."""
MIN_CORRECTION_M_RAD = 1e-9
"""Minimum change of the transform from map to odom, in m or rad, that counts as a correction."""
MAX_JUMP_S = 30.0
"""Maximum time between a jump and the jump back."""
MIN_DRIVEN_M = 0.6
"""Minimum distance between the positions at start and end of an outage: more than twice Nav2's update_min_d of
0.25 m."""


def localizer_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the faults of the localizer; none for a drive with fewer than five estimates."""
    if len(drive.belief) < 5:
        return
    if drive.has_true_poses:
        yield from _jump_faults(replace(drive, belief=belief_with_pose(drive)))
    yield from _outages(drive)


def _jump_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the first jump of the estimated pose away from the true pose and back, or a single jump without return."""
    belief, truth = drive.belief.values[:, :3], drive.poses.poses_at(drive.belief.times)
    errors = belief - truth
    errors[:, 2] = wrap_array(errors[:, 2])
    sizes, is_jump = _relative_sizes(errors), _relative_sizes(np.diff(errors, axis=0)) > 1.0
    indices = np.flatnonzero(is_jump.any(axis=1)) + 1
    if len(indices) == 1:
        yield from _lasting_jump(drive, belief, truth, sizes, int(indices[0]))
    for first, last in zip(indices[:-1].tolist(), indices[1:].tolist(), strict=True):
        begin, end = float(drive.belief.times[first]), float(drive.belief.times[last])
        is_small_outside = np.maximum(sizes[first - 1], sizes[last]) <= 0.5 * np.median(sizes[first:last], axis=0)
        jumps_back = is_jump[first - 1] & is_small_outside
        if end - begin > MAX_JUMP_S or _is_kidnapped(drive, begin - 0.5, end + 0.5) or not jumps_back.any():
            continue
        values = _jump_values(truth[first], belief[first])
        text = f"the estimated pose jumps by {_size_text(errors[first], jumps_back)} and back"
        yield FoundFault("localizer", "jump", values, begin, end - begin, Reason(text, begin, end))
        return


def _lasting_jump(drive: RecordedDrive, belief: Array, truth: Array, sizes: Array, index: int) -> Iterator[FoundFault]:
    """Yield a fault if the poses `belief` (n, 3) jump at `index` and never return to the poses `truth` (n, 3).

    `sizes` (n, 2) are the relative sizes of the errors.
    """
    begin = float(drive.belief.times[index])
    is_lasting = (sizes[index:].min(axis=0) > 1.0) & (sizes[:index].max(axis=0) < 1.0)
    if is_lasting.any() and not _is_kidnapped(drive, begin - 0.5, begin + 0.5):
        text = f"the estimated pose jumps by {_size_text(belief[index] - truth[index], is_lasting)} and stays there"
        reason = Reason(text, begin, float(drive.belief.times[-1]), "medium")
        yield FoundFault("localizer", "jump", _jump_values(truth[index], belief[index]), begin, None, reason)


def _relative_sizes(differences: Array) -> Array:
    """Return the sizes (n, 2) in position and heading of pose differences (n, 3), in multiples of the minimum jump."""
    distances = np.hypot(differences[:, 0], differences[:, 1])
    return np.column_stack((distances / MIN_JUMP_M, np.abs(wrap_array(differences[:, 2])) / MIN_JUMP_RAD))


def _size_text(error: Array, is_listed: Mask) -> str:
    """Return the size of a pose error (3,) as text. `is_listed` (2,) selects position and heading."""
    texts = f"{math.hypot(error[0], error[1]):.2f} m", f"{abs(math.degrees(wrap(error[2]))):.0f} deg"
    return " / ".join(text for text, is_part in zip(texts, is_listed, strict=True) if is_part)


def _jump_values(truth: Array, belief: Array) -> dict[str, object]:
    """Return the parameters of the fault `jump` from a true pose (3,) to the estimated pose (3,)."""
    error = Pose2(*truth.tolist()).between(Pose2(*belief.tolist()))
    return {"x": f"{error.x:.2f} m", "y": f"{error.y:.2f} m", "yaw": f"{math.degrees(error.yaw):.1f} deg"}


def _is_kidnapped(drive: RecordedDrive, begin: float, end: float) -> bool:
    """Return whether the true pose jumps, relative to the odometry, between two times in s."""
    first, last = np.searchsorted(drive.poses.times, (begin, end))
    samples = slice(max(0, first - 1), last + 1)
    motion = _relative_motion(drive.poses.values[samples])
    if len(drive.odometry) > 1:
        motion -= _relative_motion(drive.odometry.poses_at(drive.poses.times[samples]))
    return bool((_relative_sizes(motion) > 1.0).any())


def _relative_motion(poses: Array) -> Array:
    """Return the motion x, y, yaw (n - 1, 3) between poses (n, 3), each in the frame of the pose before it."""
    dx, dy, turn = np.diff(poses[:, :3], axis=0).T
    c, s = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def _outages(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the outages while the robot drives.

    Outages are gaps between estimates. Without such gaps, outages are times without corrections of the odometry.
    """
    if len(drive.odometry) < 2:
        return
    times = np.append(drive.belief.times, drive.odometry.times[-1])
    limit = max(MIN_OUTAGE_S, MIN_OUTAGE_PERIODS * drive.belief.period)
    silent_seconds = np.diff(times) - seconds_in_gaps(recording_gaps(drive), times[:-1], times[1:])
    gaps = [
        (index, float(times[index]), float(times[index + 1]))
        for index in np.flatnonzero(silent_seconds > limit).tolist()
        if _driven_distance(drive, float(times[index]), float(times[index + 1])) > MIN_DRIVEN_M
    ]
    for index, begin, end in gaps:
        text = f"no pose from the localizer for {end - begin:.1f} s"
        duration = end - begin if index + 2 < len(times) else None
        yield FoundFault("localizer", "off", {}, begin, duration, Reason(text, begin, end))
    if not gaps:
        yield from _missing_corrections(drive)


def _missing_corrections(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the outages in which the transform from map to odom stays constant although the robot drives."""
    corrections = drive.corrections
    if len(corrections) < 2:
        return
    is_constant = np.abs(np.diff(corrections.values, axis=0)).max(axis=1) < MIN_CORRECTION_M_RAD
    windows = find_windows(is_constant, corrections.times[1:])
    if not windows or is_constant.all():
        return
    usual_length = float(np.percentile([window.length for window in windows], 25)) if len(windows) >= 5 else 0.0
    limit = max(MIN_OUTAGE_S, MIN_OUTAGE_PERIODS * usual_length)
    for window in windows:
        begin, end = float(corrections.times[window.first]), window.end
        if window.length > limit and _driven_distance(drive, begin, end) > MIN_DRIVEN_M:
            text = f"the localizer does not correct the odometry for {end - begin:.1f} s"
            is_until_end = end >= float(corrections.times[-1]) - MIN_OUTAGE_S
            reason = Reason(text, begin, end, "medium")
            yield FoundFault("localizer", "off", {}, begin, None if is_until_end else end - begin, reason)


def _driven_distance(drive: RecordedDrive, begin: float, end: float) -> float:
    """Return the straight distance in m, by odometry, between the positions at two times in s."""
    ends = drive.odometry.poses_at(np.array([begin, end]))
    return float(np.hypot(*(ends[1, :2] - ends[0, :2])))
