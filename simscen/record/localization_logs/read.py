"""Reader of logs for `simscen localize`: odometry, scans, and reference poses from bags, CSV, and CARMEN files."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog, unusable_log_as_invalid_input
from simscen.record.localization_logs.rosbag import read_rosbag_rows
from simscen.record.localization_logs.rows import (
    MAX_COORDINATE_M,
    MAX_TIME_S,
    TICK_RATE_HZ,
    LocalizationRows,
    PoseRow,
    ScanRow,
    all_within,
)
from simscen.record.log_reader import invalid_log


def read_csv_rows(path: Path) -> LocalizationRows:
    """Read a CSV log. Raises UnusableLog for an invalid row."""
    rows, mount = LocalizationRows(hint="see `simscen localize --help` for its columns"), Pose2(0.0, 0.0)
    with path.open(encoding="utf-8", newline="") as lines:
        for number, row in _numbered_rows(lines, rows.hint):
            cells = [cell.strip() for cell in row]
            if not cells or not cells[0] or cells[0].startswith("#"):
                continue
            try:
                values = [float(cell) for cell in cells[1:] if cell]
                if cells[0] == "mount":
                    mount = _checked_pose(values, 3)
                else:
                    _add_row(rows, cells[0], number, values, mount)
            except ValueError as error:
                raise UnusableLog(f"line {number}: {error}", rows.hint) from error
    return rows


def _numbered_rows(lines: Iterable[str], hint: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a file, numbered from 1."""
    reader = csv.reader(lines)
    try:
        yield from enumerate(reader, 1)
    except csv.Error as error:
        raise UnusableLog(f"line {reader.line_num} is not CSV: {error}", hint) from error


def _add_row(rows: LocalizationRows, kind: str, order: int, values: list[float], mount: Pose2) -> None:
    match kind:
        case "odom" | "truth":
            time, pose = (values or [math.nan])[0], values[1:]
            target = rows.odometry if kind == "odom" else rows.truth
            _check_time(time)
            target.append(PoseRow(time, order, _checked_pose(pose, 3)))
        case "scan":
            if len(values) < 6 or not all(math.isfinite(value) for value in values[:5]):
                raise ValueError("a scan needs TIME, ANGLE_MIN, ANGLE_INCREMENT, RANGE_MIN, RANGE_MAX and ranges")
            time, first, step, range_min, range_max = values[:5]
            _check_time(time)
            rows.scans.append(ScanRow(time, order, np.array(values[5:]), (first, step, range_min, range_max), mount))
        case _:
            raise ValueError(f"unknown kind of row {kind!r}; use odom, scan, truth or mount")


def _check_time(time: float) -> None:
    if not all_within((time,), MAX_TIME_S):
        raise ValueError(f"{time} is not a valid time")


def _checked_pose(values: list[float], count: int) -> Pose2:
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise ValueError(f"expected {count} numbers, got {values}")
    if not all_within(values, MAX_COORDINATE_M):
        raise ValueError(f"invalid coordinates {values}")
    return Pose2(*values)


DEFAULT_MAX_RANGE_M = 81.9
"""Range that a SICK LMS reports for a beam without a hit. FLASER lines do not contain the maximum range."""


def read_carmen_rows(path: Path) -> LocalizationRows:
    """Read odometry (ODOM and laser lines), scans (FLASER, ROBOTLASER1) and reference (TRUEPOS) of a CARMEN log."""
    rows = LocalizationRows(hint="its lines must start with ODOM, FLASER or ROBOTLASER1")
    with path.open(encoding="utf-8", errors="strict") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            if words and words[0] in _LINE_PARSERS:
                try:
                    _LINE_PARSERS[words[0]](rows, number, words)
                except (ValueError, IndexError) as error:
                    raise UnusableLog(f"line {number} is not a {words[0]} line: {error}") from error
    return rows


def _parse_odom(rows: LocalizationRows, order: int, words: list[str]) -> None:
    rows.odometry.append(PoseRow(_time(words[-3]), order, _pose(words[1:4])))


def _parse_truepos(rows: LocalizationRows, order: int, words: list[str]) -> None:
    rows.truth.append(PoseRow(_time(words[-3]), order, _pose(words[1:4])))


def _parse_flaser(rows: LocalizationRows, order: int, words: list[str]) -> None:
    """Read `FLASER n r… x y theta odom_x odom_y odom_theta time host logger_time`."""
    count = int(words[1])
    ranges, rest = _ranges(words[2 : 2 + count], count), words[2 + count :]
    time = _time(rest[6])
    step = math.pi / max(1, count - 1) if count % 2 else math.pi / count
    rows.odometry.append(PoseRow(time, order, _pose(rest[3:6])))
    mount = _relative_pose(_pose(rest[3:6]), _pose(rest[:3]))
    mount = mount if math.hypot(*mount[:2]) < 1.0 else Pose2(0.0, 0.0)  # some logs have corrected poses here
    rows.scans.append(ScanRow(time, order, ranges, (-math.pi / 2, step, 0.0, DEFAULT_MAX_RANGE_M), mount))


def _parse_robotlaser(rows: LocalizationRows, order: int, words: list[str]) -> None:
    """Read `ROBOTLASER1 type start fov step max accuracy mode n r… m remission… laser robot … time host time`."""
    first, _, step, range_max = (_parse_finite(word) for word in words[2:6])
    count = int(words[8])
    ranges = _ranges(words[9 : 9 + count], count)
    rest = words[10 + count + int(words[9 + count]) :]
    time, laser, robot = _time(words[-3]), _pose(rest[:3]), _pose(rest[3:6])
    rows.odometry.append(PoseRow(time, order, robot))
    rows.scans.append(ScanRow(time, order, ranges, (first, step, 0.0, range_max), _relative_pose(robot, laser)))


def _ranges(words: list[str], count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    if len(words) != count or count < 1:
        raise ValueError(f"expected {count} ranges, got {len(words)}")
    return np.array([float(word) for word in words])


def _pose(words: list[str]) -> Pose2:
    x, y, yaw = (_parse_finite(word) for word in words)
    if not all_within((x, y, yaw), MAX_COORDINATE_M):
        raise ValueError(f"invalid coordinates {x:g}, {y:g}")
    return Pose2(x, y, yaw)


def _relative_pose(base: Pose2, other: Pose2) -> Pose2:
    dx, dy, c, s = other.x - base.x, other.y - base.y, math.cos(base.yaw), math.sin(base.yaw)
    return Pose2(c * dx + s * dy, c * dy - s * dx, math.remainder(other.yaw - base.yaw, 2 * math.pi))


def _time(word: str) -> float:
    if not all_within((value := _parse_finite(word),), MAX_TIME_S):
        raise ValueError(f"{word} is not a valid time")
    return value


def _parse_finite(word: str) -> float:
    if not math.isfinite(value := float(word)):
        raise ValueError(f"{word} is not a number")
    return value


_LINE_PARSERS = {
    "ODOM": _parse_odom,
    "FLASER": _parse_flaser,
    "ROBOTLASER1": _parse_robotlaser,
    "TRUEPOS": _parse_truepos,
}


@dataclass(frozen=True, eq=False)
class LocalizationLog:
    """Recorded input of a localizer. Ticks count from the first reading, TICK_RATE_HZ per second.

    Attributes:
        readings: Readings in the order in which the robot received them.
        ticks: Ticks (n,) of the reference poses.
        truth: Reference poses x, y, yaw (n, 3) in the map frame.
        notes: Remarks for the user.
        initial_pose: Pose at the start of the odometry, from the first pose that was sent to the localizer.
    """

    readings: Sequence[Odometry | Scan]
    ticks: Ticks
    truth: Array
    notes: Sequence[str] = ()
    initial_pose: Pose2 | None = None


def read_localization_log(path: Path, odometry: str, scan: str, reference: str | None) -> LocalizationLog:
    """Read odometry, scans and a reference from a rosbag2 folder, an MCAP file, a CARMEN log or a CSV file.

    The topics apply to ROS logs only. Without `reference`, the ground truth of simscen's logs is used. CARMEN logs have
    the reference in TRUEPOS lines, and CSV files in `truth` rows. Raises InvalidInput if the log cannot be used.
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
    start = min(*(row.time for row in rows.odometry), *(row.time for row in rows.scans))

    def tick(time: float) -> int:
        return round((time - start) * TICK_RATE_HZ)

    ordered: list[tuple[int, int, Odometry | Scan]] = [
        (row.order, 0, Odometry("odom", tick(row.time), row.pose, Twist())) for row in rows.odometry
    ]
    ordered += [(row.order, 1, _scan(row, tick(row.time))) for row in rows.scans]
    ordered.sort(key=lambda item: item[:2])
    truth = {tick(row.time): row.pose for row in rows.truth}
    ticks = np.array(sorted(truth), dtype=np.int64)
    poses = np.array([truth[tick] for tick in sorted(truth)], dtype=np.float64).reshape(-1, 3)
    readings = [reading for *_, reading in ordered]
    return LocalizationLog(readings, ticks, poses, [*rows.notes, *_check_readings(readings)], _initial_pose(rows))


def _initial_pose(rows: LocalizationRows) -> Pose2 | None:
    """Return the pose at the start of the odometry, from the first initial pose and the odometry until then."""
    if not rows.initial:
        return None
    first = min(rows.initial, key=lambda row: row.order)
    nearest = min(rows.odometry, key=lambda row: abs(row.time - first.time))
    return first.pose.compose(nearest.pose.between(rows.odometry[0].pose))


def _check_readings(readings: Sequence[Odometry | Scan]) -> Iterator[str]:
    """Yield remarks on readings that a localizer cannot use. Raises UnusableLog if no scan can be used."""
    all_scans = [reading for reading in readings if isinstance(reading, Scan)]
    if any(scan.angle_increment == 0.0 and len(scan.ranges) > 1 for scan in all_scans):
        raise UnusableLog("all beams of a scan have the same direction: its angle_increment is 0")
    if empty := sum(not len(scan.points()) for scan in all_scans):
        yield f"{empty} of {len(all_scans)} scans have no range between their range_min and range_max"
    odometry = np.array([reading.tick for reading in readings if isinstance(reading, Odometry)])
    scans = np.array([scan.tick for scan in all_scans])
    if late := int((np.diff(np.maximum.accumulate(odometry)) == 0).sum()):
        yield f"{late} of {len(odometry)} odometry readings are not newer than an earlier one and are ignored"
    outside = int(((scans < odometry[0]) | (scans > odometry.max())).sum())
    if outside == len(scans):
        hint = "do the topics belong to the same robot and clock?"
        raise UnusableLog("no scan was measured while there was odometry", hint)
    if outside:
        yield f"{outside} of {len(scans)} scans were measured before the odometry starts or after it ends"


def _scan(row: ScanRow, tick: int) -> Scan:
    first, increment, range_min, range_max = row.layout
    return Scan("lidar", tick, row.ranges, first, increment, range_min, range_max, row.mount)
