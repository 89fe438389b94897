"""Reader of odometry, scans, and reference poses from a log of any supported format."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog, unusable_log_as_invalid_input
from simscen.record.localization_logs.rosbag import read_rosbag_rows
from simscen.record.localization_logs.rows import TICK_RATE_HZ, LocalizationRows, PoseRow
from simscen.record.localization_logs.text_formats import read_carmen_rows, read_csv_rows
from simscen.record.log_reader import invalid_log


@dataclass(frozen=True, eq=False)
class LocalizationLog:
    """Recorded input of a localizer, and reference poses.

    Tick 0 is the time of the first reading. There are TICK_RATE_HZ ticks per second.

    Attributes:
        readings: Readings in the order of the log.
        ticks: Ticks (n,) of the reference poses.
        truth: Reference poses x, y, yaw (n, 3) in the map frame.
        notes: Remarks for the user.
        initial_pose: Pose at the start of the odometry, from the reference poses. If the log has no reference poses,
            from its first initial pose. None if the log has neither.
    """

    readings: Sequence[Odometry | Scan]
    ticks: Ticks
    truth: Array
    notes: Sequence[str] = ()
    initial_pose: Pose2 | None = None


def read_localization_log(path: Path, odometry: str, scan: str, reference: str | None) -> LocalizationLog:
    """Read odometry, scans, and reference poses from a rosbag2 folder, an MCAP file, a CARMEN log, or a CSV file.

    `odometry`, `scan`, and `reference` are topics or pairs of frames in a ROS log, see `read_rosbag_rows`. Raises
    InvalidInput if the log cannot be used.
    """
    with unusable_log_as_invalid_input(path):
        try:
            if path.suffix == ".csv":
                rows = read_csv_rows(path)
            elif path.suffix in (".log", ".clf", ".carmen"):
                rows = read_carmen_rows(path)
            else:
                rows = read_rosbag_rows(path, odometry, scan, reference)
        except UnicodeDecodeError as error:
            raise invalid_log(path, "SC802", "the log is not text") from error
        for kind, kind_rows in (("odometry", rows.odometry), ("scans", rows.scans)):
            if not kind_rows:
                raise UnusableLog(f"it has no {kind}", rows.hint)
        return _to_log(rows)


def _to_log(rows: LocalizationRows) -> LocalizationLog:
    """Convert rows with times to readings and reference poses with ticks."""
    start = min(*(row.time for row in rows.odometry), *(row.time for row in rows.scans))

    def tick_at(time: float) -> int:
        return round((time - start) * TICK_RATE_HZ)

    # If odometry and a scan are in the same row of the log, odometry comes first.
    ordered: list[tuple[int, int, Odometry | Scan]] = [
        (row.order, 0, Odometry("odom", tick_at(row.time), row.pose, Twist())) for row in rows.odometry
    ]
    ordered += [
        (row.order, 1, Scan("lidar", tick_at(row.time), row.ranges, *row.layout, row.mount)) for row in rows.scans
    ]
    ordered.sort(key=lambda item: item[:2])
    truth = {tick_at(row.time): row.pose for row in rows.truth}
    ticks = np.array(sorted(truth), dtype=np.int64)
    poses = np.array([truth[tick] for tick in sorted(truth)], dtype=np.float64).reshape(-1, 3)
    readings = [reading for *_, reading in ordered]
    initial_pose = _start_from_reference(rows) or _start_from_initial_pose(rows)
    return LocalizationLog(readings, ticks, poses, [*rows.notes, *_check_readings(readings)], initial_pose)


def _start_from_reference(rows: LocalizationRows) -> Pose2 | None:
    """Return the reference pose at the start of the odometry; None without reference poses.

    If the reference poses start later, return the first one, moved back by the motion that odometry measured before it.
    """
    if not rows.truth:
        return None
    start, first = rows.odometry[0], min(rows.truth, key=lambda row: row.time)
    if first.time <= start.time:
        return _pose_at(rows.truth, start.time)
    return first.pose.compose(_pose_at(rows.odometry, first.time).between(start.pose))


def _pose_at(rows: Sequence[PoseRow], time: float) -> Pose2:
    """Return the interpolated pose at a time in s. The pose is constant before the first and after the last row."""
    ordered = sorted(rows, key=lambda row: row.time)
    times = [row.time for row in ordered]
    yaw = np.interp(time, times, np.unwrap([row.pose.yaw for row in ordered]))
    x, y = (np.interp(time, times, values) for values in zip(*((r.pose.x, r.pose.y) for r in ordered), strict=True))
    return Pose2(float(x), float(y), wrap(float(yaw)))


def _start_from_initial_pose(rows: LocalizationRows) -> Pose2 | None:
    """Return the first initial pose, moved back by the motion that odometry measured before it; None without one."""
    if not rows.initial_poses:
        return None
    # The stamp of an initial pose is often zero, so the order of logging counts.
    first = min(rows.initial_poses, key=lambda row: row.order)
    start = rows.odometry[0]
    previous = next((row for row in reversed(rows.odometry) if row.order < first.order), start)
    return first.pose.compose(previous.pose.between(start.pose))


def _check_readings(readings: Sequence[Odometry | Scan]) -> Iterator[str]:
    """Yield remarks on readings that a localizer cannot use. Raises UnusableLog if no scan can be used."""
    all_scans = [reading for reading in readings if isinstance(reading, Scan)]
    if any(scan.angle_increment == 0.0 and len(scan.ranges) > 1 for scan in all_scans):
        raise UnusableLog("all beams of a scan have the same direction: its angle_increment is 0")
    if empty := sum(not len(scan.points()) for scan in all_scans):
        yield f"{empty} of {len(all_scans)} scans have no range between their range_min and range_max"
    odometry_ticks = np.array([reading.tick for reading in readings if isinstance(reading, Odometry)])
    scan_ticks = np.array([scan.tick for scan in all_scans])
    if late := int((np.diff(np.maximum.accumulate(odometry_ticks)) == 0).sum()):
        yield f"{late} of {len(odometry_ticks)} odometry readings are not newer than an earlier one and are ignored"
    outside = int(((scan_ticks < odometry_ticks[0]) | (scan_ticks > odometry_ticks.max())).sum())
    if outside == len(scan_ticks):
        hint = "do the topics belong to the same robot and clock?"
        raise UnusableLog("no scan was measured while there was odometry", hint)
    if outside:
        yield f"{outside} of {len(scan_ticks)} scans were measured before the odometry starts or after it ends"
