"""Reader of localization logs in text formats: CSV and CARMEN.

A CSV file has one row per reading:

    odom,TIME,X,Y,YAW
    scan,TIME,ANGLE_MIN,ANGLE_INCREMENT,RANGE_MIN,RANGE_MAX,R0,R1,…
    truth,TIME,X,Y,YAW
    mount,X,Y,YAW

Units are seconds, meters and radians. A range is `inf` without a hit and `nan` without a measurement. `mount` is the
pose of the lidar on the robot for all scans that follow. Empty rows and rows that start with `#` are ignored.

CARMEN is the format of most published lidar data sets (Radish, the SLAM benchmarks of Freiburg and Bonn). Source: the
message formats in the header of each log. The time is the third field from the end of a line.
"""

import csv
import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.localization_logs.rows import (
    MAX_COORDINATE_M,
    MAX_TIME_S,
    LocalizationRows,
    PoseRow,
    ScanRow,
    Triple,
    all_within,
)


def read_csv_rows(path: Path) -> LocalizationRows:
    """Read a CSV log. Raises UnusableLog for an invalid row."""
    rows, mount = LocalizationRows(hint="see `simscen localize --help` for its columns"), (0.0, 0.0, 0.0)
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


def _add_row(rows: LocalizationRows, kind: str, order: int, values: list[float], mount: Triple) -> None:
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


def _checked_pose(values: list[float], count: int) -> Triple:
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise ValueError(f"expected {count} numbers, got {values}")
    if not all_within(values, MAX_COORDINATE_M):
        raise ValueError(f"invalid coordinates {values}")
    x, y, yaw = values
    return x, y, yaw


DEFAULT_MAX_RANGE_M = 81.9
"""Range of a SICK LMS without a hit. FLASER lines do not contain the maximum range."""


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
    mount = mount if math.hypot(*mount[:2]) < 1.0 else (0.0, 0.0, 0.0)  # some logs have corrected poses here
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


def _ranges(words: list[str], count: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    if len(words) != count or count < 1:
        raise ValueError(f"expected {count} ranges, got {len(words)}")
    return np.array([float(word) for word in words])


def _pose(words: list[str]) -> Triple:
    x, y, yaw = (_parse_finite(word) for word in words)
    if not all_within((x, y, yaw), MAX_COORDINATE_M):
        raise ValueError(f"invalid coordinates {x:g}, {y:g}")
    return x, y, yaw


def _relative_pose(base: Triple, other: Triple) -> Triple:
    dx, dy, c, s = other[0] - base[0], other[1] - base[1], math.cos(base[2]), math.sin(base[2])
    return c * dx + s * dy, c * dy - s * dx, math.remainder(other[2] - base[2], 2 * math.pi)


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
