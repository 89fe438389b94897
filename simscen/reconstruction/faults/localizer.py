"""Finds faults of the localizer: outages, and jumps of the estimated pose."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.reasons import FoundFault, Reason, windows

MIN_JUMP_M, MIN_JUMP_RAD = 0.2, math.radians(10)
"""Minimum change of the error of position or heading, from one estimate to the next, that counts as a jump."""
MIN_OUTAGE_S, MIN_OUTAGE_PERIODS = 1.0, 6.0
"""Minimum duration of a reported outage: the larger of a time and a multiple of the period of the estimates."""
MIN_CORRECTION_M_RAD = 1e-9
"""Minimum change of the transform from map to odom, in m or rad, that counts as a correction."""
MAX_JUMP_S = 30.0
"""Maximum time between a jump and the jump back."""
MIN_DRIVEN_M = 0.6
"""Minimum distance between the positions at start and end of an outage: over twice Nav2's update_min_d of 0.25 m."""


def localizer_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the faults of the localizer; none for a drive with fewer than five estimates."""
    if len(drive.belief) < 5:
        return
    yield from _jump(drive)
    yield from _outages(drive)


def _jump(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the first jump of the estimated pose away from the true pose and back, or a single jump without return."""
    if not drive.has_true_poses:
        return
    belief, truth = drive.belief.values[:, :3], drive.poses.poses_at(drive.belief.times)
    errors = belief - truth
    errors[:, 2] = wrap_array(errors[:, 2])
    distance = np.hypot(*np.diff(errors[:, :2], axis=0).T)
    turn = np.abs(wrap_array(np.diff(errors[:, 2])))
    jumps = np.flatnonzero((distance > MIN_JUMP_M) | (turn > MIN_JUMP_RAD)) + 1
    if len(jumps) == 1:
        yield from _lasting_jump(drive, belief, truth, int(jumps[0]))
    for out, back in zip(jumps[:-1].tolist(), jumps[1:].tolist(), strict=True):
        begin, end = float(drive.belief.times[out]), float(drive.belief.times[back])
        away = np.hypot(*errors[out:back, :2].T)
        before, after = np.hypot(*errors[out - 1, :2]), np.hypot(*errors[back, :2])
        if (
            end - begin > MAX_JUMP_S
            or _is_kidnapped(drive, begin - 0.5, end + 0.5)
            or max(before, after) > 0.5 * float(np.median(away))
        ):
            continue
        values = _jump_values(truth[out], belief[out])
        text = f"the estimated pose jumps by {float(away[0]):.2f} m and back"
        yield FoundFault("localizer", "jump", values, begin, end - begin, Reason(text, begin, end))
        return


def _lasting_jump(drive: RecordedDrive, belief: Array, truth: Array, index: int) -> Iterator[FoundFault]:
    """Yield the fault of a jump of the poses `belief` (n, 3) at `index` if they never return to `truth` (n, 3)."""
    begin, errors = float(drive.belief.times[index]), np.hypot(*(belief - truth)[:, :2].T)
    stays = float(errors[index:].min()) > MIN_JUMP_M and float(errors[:index].max()) < MIN_JUMP_M
    if stays and not _is_kidnapped(drive, begin - 0.5, begin + 0.5):
        text = f"the estimated pose jumps by {float(errors[index]):.2f} m and stays there"
        reason = Reason(text, begin, float(drive.belief.times[-1]), "medium")
        yield FoundFault("localizer", "jump", _jump_values(truth[index], belief[index]), begin, None, reason)


def _jump_values(truth: Array, belief: Array) -> dict[str, object]:
    """Return the parameters of the fault `jump` from a true pose (3,) to the estimated pose (3,)."""
    error = Pose2(*truth.tolist()).between(Pose2(*belief.tolist()))
    return {"x": f"{error.x:.2f} m", "y": f"{error.y:.2f} m", "yaw": f"{math.degrees(error.yaw):.1f} deg"}


def _is_kidnapped(drive: RecordedDrive, begin: float, end: float) -> bool:
    """Return whether the true pose jumps between two times in s."""
    chosen = (drive.poses.times >= begin) & (drive.poses.times <= end)
    steps = np.hypot(*np.diff(drive.poses.values[chosen, :2], axis=0).T)
    return bool((steps > MIN_JUMP_M).any())


def _outages(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the outages while the robot drives: gaps between estimates or, without gaps, missing corrections."""
    times = drive.belief.times
    limit = max(MIN_OUTAGE_S, MIN_OUTAGE_PERIODS * drive.belief.period)
    gaps = np.flatnonzero(np.diff(times) > limit)
    for index in gaps.tolist():
        begin, end = float(times[index]), float(times[index + 1])
        if len(drive.odometry) > 1 and _distance(drive, begin, end) > MIN_DRIVEN_M:
            text = f"no pose from the localizer for {end - begin:.1f} s"
            yield FoundFault("localizer", "off", {}, begin, end - begin, Reason(text, begin, end))
    if not len(gaps):
        yield from _without_corrections(drive)


def _without_corrections(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the outages in which the transform from map to odom stays constant although the robot drives."""
    corrections = drive.corrections
    if len(corrections) < 2 or len(drive.odometry) < 2:
        return
    still = np.abs(np.diff(corrections.values, axis=0)).max(axis=1) < MIN_CORRECTION_M_RAD
    usual = windows(still, corrections.times[1:])
    if not usual or still.all():
        return
    shortest = float(np.percentile([window.length for window in usual], 25)) if len(usual) >= 5 else 0.0
    limit = max(MIN_OUTAGE_S, MIN_OUTAGE_PERIODS * shortest)
    for window in usual:
        if window.length > limit and _distance(drive, window.begin, window.end) > MIN_DRIVEN_M:
            text = f"the localizer does not correct the odometry for {window.length:.1f} s"
            reason = Reason(text, window.begin, window.end, "medium")
            until_end = window.end >= float(corrections.times[-1]) - MIN_OUTAGE_S
            yield FoundFault("localizer", "off", {}, window.begin, None if until_end else window.length, reason)


def _distance(drive: RecordedDrive, begin: float, end: float) -> float:
    """Return the straight distance in m, by odometry, between the positions at two times in s."""
    ends = drive.odometry.poses_at(np.array([begin, end]))
    return float(np.hypot(*(ends[1, :2] - ends[0, :2])))
