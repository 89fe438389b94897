"""Logs as CSV: one row for each reading, its kind first.

    odom,TIME,X,Y,YAW
    scan,TIME,ANGLE_MIN,ANGLE_INCREMENT,RANGE_MIN,RANGE_MAX,R0,R1,…
    truth,TIME,X,Y,YAW
    mount,X,Y,YAW

Seconds, meters, radians; `inf` where a beam hit nothing, `nan` where it gave no answer. `mount` is where the lidar is
on the robot, for all scans after it. Rows that are empty or begin with `#` mean nothing.
"""

import csv
import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from simscen.record.foreign.sensedrows import FURTHEST, LATEST, Range, Rows, Stamped, Triple, usable
from simscen.record.foreign.unusable import Unusable


def csv_rows(path: Path) -> Rows:
    """The rows of a CSV log. Raises Unusable for one that is none of these."""
    rows, mount = Rows(hint="see `simscen localize --help` for its columns"), (0.0, 0.0, 0.0)
    with path.open(encoding="utf-8", newline="") as lines:
        for number, row in _numbered(lines, rows.hint):
            words = [word.strip() for word in row]
            if not words or not words[0] or words[0].startswith("#"):
                continue
            try:
                values = [float(word) for word in words[1:] if word]
                if words[0] == "mount":
                    mount = _finite(values, 3)
                else:
                    _take(rows, words[0], number, values, mount)
            except ValueError as error:
                raise Unusable(f"line {number}: {error}", rows.hint) from error
    return rows


def _numbered(lines: Iterable[str], hint: str) -> Iterator[tuple[int, list[str]]]:
    """The rows of a file from 1 on."""
    reader = csv.reader(lines)
    try:
        yield from enumerate(reader, 1)
    except csv.Error as error:
        raise Unusable(f"line {reader.line_num} is not CSV: {error}", hint) from error


def _take(rows: Rows, kind: str, order: int, values: list[float], mount: Triple) -> None:
    match kind:
        case "odom" | "truth":
            time, pose = (values or [math.nan])[0], values[1:]
            told = rows.odometry if kind == "odom" else rows.truth
            _check_time(time)
            told.append(Stamped(time, order, _finite(pose, 3)))
        case "scan":
            if len(values) < 6 or not all(math.isfinite(value) for value in values[:5]):
                raise ValueError("a scan has a time, four numbers that describe it, and ranges")
            time, first, step, least, most = values[:5]
            _check_time(time)
            rows.scans.append(Range(time, order, np.array(values[5:]), (first, step, least, most), mount))
        case _:
            raise ValueError(f"no kind of row is called {kind!r}; known: odom, scan, truth, mount")


def _check_time(time: float) -> None:
    if not usable((time,), LATEST):
        raise ValueError(f"{time} is not a time")


def _finite(values: list[float], count: int) -> Triple:
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise ValueError(f"expected {count} numbers, got {values}")
    if not usable(values, FURTHEST):
        raise ValueError(f"no place is at {values}")
    x, y, yaw = values
    return x, y, yaw
