"""Readers of localization logs in text formats: CSV and CARMEN."""

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.localization_logs.rows import (
    MAX_COORDINATE_M,
    MAX_TIME_S,
    LocalizationRows,
    PoseRow,
    ScanRow,
    all_within,
)


def read_csv_rows(path: Path) -> LocalizationRows:
    """Read a CSV file. Raises UnusableLog for an invalid row.

    The first cell of a row is the kind of the row. The other cells, in s, m, and rad, are:

    odom, truth:  time, x, y, yaw
    scan:         time, first angle, angle increment, minimum range, maximum range, ranges
    mount:        x, y, yaw of the lidar on the base, for the scans in the rows below
    """
    rows, mount = LocalizationRows(hint="see `simscen localize --help` for its columns"), Pose2(0.0, 0.0)
    with path.open(encoding="utf-8-sig", newline="") as lines:
        reader = csv.reader(lines)
        try:
            for row_number, row in enumerate(reader, 1):
                cells = [cell.strip() for cell in row]
                while cells and not cells[-1]:  # a spreadsheet pads short rows
                    cells.pop()
                if not cells or not cells[0] or cells[0].startswith("#"):
                    continue
                try:
                    if cells[0] == "mount":
                        mount = _pose(cells[1:])
                    else:
                        _add_row(rows, cells[0], row_number, cells[1:], mount)
                except ValueError as error:
                    raise UnusableLog(f"line {row_number}: {error}", rows.hint) from error
        except csv.Error as error:
            raise UnusableLog(f"line {reader.line_num} is not CSV: {error}", rows.hint) from error
    return rows


def _add_row(rows: LocalizationRows, kind: str, order: int, cells: list[str], mount: Pose2) -> None:
    """Add a row of the CSV file to `rows`. `order` is the number of the row. `mount` is the pose of the lidar."""
    match kind:
        case "odom" | "truth":
            target = rows.odometry if kind == "odom" else rows.truth
            target.append(PoseRow(_time(cells[0] if cells else ""), order, _pose(cells[1:])))
        case "scan":
            values = [float(cell) for cell in cells]
            if len(values) < 6 or not all(math.isfinite(value) for value in values[:5]):
                raise ValueError("a scan needs TIME, ANGLE_MIN, ANGLE_INCREMENT, RANGE_MIN, RANGE_MAX and ranges")
            angle_min, angle_increment, range_min, range_max = values[1:5]
            layout = angle_min, angle_increment, range_min, range_max
            rows.scans.append(ScanRow(_time(cells[0]), order, np.array(values[5:]), layout, mount))
        case _:
            raise ValueError(f"unknown kind of row {kind!r}; use odom, scan, truth or mount")


DEFAULT_MAX_RANGE_M = 81.9
"""Maximum range of scans in FLASER lines, which do not contain it. A SICK LMS returns it for a beam without a hit."""


def read_carmen_rows(path: Path) -> LocalizationRows:
    """Read a CARMEN log. Raises UnusableLog for an invalid line.

    ODOM, FLASER, and ROBOTLASER1 lines contain odometry. FLASER and ROBOTLASER1 lines also contain scans. TRUEPOS lines
    contain reference poses. Other lines are ignored.
    """
    rows = LocalizationRows(hint="its lines must start with ODOM, FLASER or ROBOTLASER1")
    with path.open(encoding="utf-8-sig") as lines:
        for line_number, line in enumerate(lines, 1):
            words = line.split()
            if words and words[0] in _LINE_PARSERS:
                try:
                    _LINE_PARSERS[words[0]](rows, line_number, words)
                except (ValueError, IndexError) as error:
                    raise UnusableLog(f"line {line_number} is not a {words[0]} line: {error}") from error
    return rows


def _parse_odom(rows: LocalizationRows, order: int, words: list[str]) -> None:
    rows.odometry.append(PoseRow(_time(words[-3]), order, _pose(words[1:4])))


def _parse_truepos(rows: LocalizationRows, order: int, words: list[str]) -> None:
    rows.truth.append(PoseRow(_time(words[-3]), order, _pose(words[1:4])))


def _parse_flaser(rows: LocalizationRows, order: int, words: list[str]) -> None:
    """Parse `FLASER n r… x y theta odom_x odom_y odom_theta time host logger_time`."""
    count = int(words[1])
    ranges, other_words = _ranges(words[2 : 2 + count], count), words[2 + count :]
    lidar, robot, time = _pose(other_words[:3]), _pose(other_words[3:6]), _time(other_words[6])
    angle_increment = math.pi / max(1, count - 1) if count % 2 else math.pi / count
    rows.odometry.append(PoseRow(time, order, robot))
    mount = _relative_pose(robot, lidar)
    if math.hypot(*mount[:2]) >= 1.0:  # some logs have corrected poses of the robot instead of poses of the lidar
        mount = Pose2(0.0, 0.0)
    rows.scans.append(ScanRow(time, order, ranges, (-math.pi / 2, angle_increment, 0.0, DEFAULT_MAX_RANGE_M), mount))


def _parse_robotlaser(rows: LocalizationRows, order: int, words: list[str]) -> None:
    """Parse `ROBOTLASER1 type start fov step max accuracy mode n r… m remission… laser robot … time host time`.

    `laser` and `robot` are poses x, y, theta.
    """
    angle_min, _, angle_increment, range_max = (float(word) for word in words[2:6])
    if not all(map(math.isfinite, (angle_min, angle_increment, range_max))):
        raise ValueError("an angle or the maximum range is not finite")
    count = int(words[8])
    ranges = _ranges(words[9 : 9 + count], count)
    other_words = words[10 + count + int(words[9 + count]) :]
    time, laser, robot = _time(words[-3]), _pose(other_words[:3]), _pose(other_words[3:6])
    layout = angle_min, angle_increment, 0.0, range_max
    rows.odometry.append(PoseRow(time, order, robot))
    rows.scans.append(ScanRow(time, order, ranges, layout, _relative_pose(robot, laser)))


def _ranges(words: list[str], count: int) -> Array:
    if len(words) != count or count < 1:
        raise ValueError(f"expected {count} ranges, got {len(words)}")
    return np.array([float(word) for word in words])


def _pose(words: list[str]) -> Pose2:
    if len(words) != 3:
        raise ValueError(f"expected 3 numbers, got {words}")
    x, y, yaw = (float(word) for word in words)
    if not all_within((x, y, yaw), MAX_COORDINATE_M):
        raise ValueError(f"invalid coordinates {x:g}, {y:g}, {yaw:g}")
    return Pose2(x, y, yaw)


def _relative_pose(base: Pose2, other: Pose2) -> Pose2:
    """Return the pose `other` in the frame of `base`. The rounding differs from Pose2.between."""
    dx, dy, c, s = other.x - base.x, other.y - base.y, math.cos(base.yaw), math.sin(base.yaw)
    return Pose2(c * dx + s * dy, c * dy - s * dx, math.remainder(other.yaw - base.yaw, 2 * math.pi))


def _time(word: str) -> float:
    if not all_within((value := float(word),), MAX_TIME_S):
        raise ValueError(f"{word} is not a valid time")
    return value


_LINE_PARSERS: dict[str, Callable[[LocalizationRows, int, list[str]], None]] = {
    "ODOM": _parse_odom,
    "FLASER": _parse_flaser,
    "ROBOTLASER1": _parse_robotlaser,
    "TRUEPOS": _parse_truepos,
}
"""Functions that add a line of a CARMEN log to rows, by the first word of the line.

Their arguments are the rows, the number of the line, and the words of the line."""
