"""Logs of CARMEN, the format of most published lidar data (Radish; Freiburg's and Bonn's SLAM benchmarks).

Source: carmen's logger (log_format of each message in its header). Angles in rad, lengths in m; the time is the last
but one but one field of each line.
"""

import math
from pathlib import Path

import numpy as np

from simscen.record.foreign.sensedrows import FURTHEST, LATEST, Range, Rows, Stamped, Triple, usable
from simscen.record.foreign.unusable import Unusable

MOST = 81.9
"""What a SICK LMS says where nothing was hit, in m: FLASER lines do not tell."""


def carmen_rows(path: Path) -> Rows:
    """The odometry (ODOM and what the lasers repeat of it), scans (FLASER, ROBOTLASER1) and TRUEPOS of a log."""
    rows = Rows(hint="its lines should begin with ODOM, FLASER or ROBOTLASER1")
    with path.open(encoding="utf-8", errors="strict") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            if words and words[0] in _LINES:
                try:
                    _LINES[words[0]](rows, number, words)
                except (ValueError, IndexError) as error:
                    raise Unusable(f"line {number} is not a {words[0]} line: {error}") from error
    return rows


def _odom(rows: Rows, order: int, words: list[str]) -> None:
    rows.odometry.append(Stamped(_time(words[-3]), order, _pose(words[1:4])))


def _truepos(rows: Rows, order: int, words: list[str]) -> None:
    rows.truth.append(Stamped(_time(words[-3]), order, _pose(words[1:4])))


def _flaser(rows: Rows, order: int, words: list[str]) -> None:
    """FLASER n r… x y theta odom_x odom_y odom_theta time host logger_time."""
    count = int(words[1])
    ranges, rest = _ranges(words[2 : 2 + count], count), words[2 + count :]
    time = _time(rest[6])
    step = math.pi / max(1, count - 1) if count % 2 else math.pi / count
    rows.odometry.append(Stamped(time, order, _pose(rest[3:6])))
    mount = _between(_pose(rest[3:6]), _pose(rest[:3]))
    mounted = mount if math.hypot(*mount[:2]) < 1.0 else (0.0, 0.0, 0.0)  # a corrected pose is not the lidar's mount
    rows.scans.append(Range(time, order, ranges, (-math.pi / 2, step, 0.0, MOST), mounted))


def _robotlaser(rows: Rows, order: int, words: list[str]) -> None:
    """ROBOTLASER1 type first fov step most accuracy mode n r… m remission… laser, robot, …, time host time."""
    first, _, step, most = (_finite(word) for word in words[2:6])
    count = int(words[8])
    ranges = _ranges(words[9 : 9 + count], count)
    rest = words[10 + count + int(words[9 + count]) :]
    time, laser, robot = _time(words[-3]), _pose(rest[:3]), _pose(rest[3:6])
    rows.odometry.append(Stamped(time, order, robot))
    rows.scans.append(Range(time, order, ranges, (first, step, 0.0, most), _between(robot, laser)))


def _ranges(words: list[str], count: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    if len(words) != count or count < 1:
        raise ValueError(f"expected {count} ranges, got {len(words)}")
    return np.array([float(word) for word in words])


def _pose(words: list[str]) -> Triple:
    x, y, yaw = (_finite(word) for word in words)
    if not usable((x, y, yaw), FURTHEST):
        raise ValueError(f"no place is at {x:g}, {y:g}")
    return x, y, yaw


def _between(base: Triple, other: Triple) -> Triple:
    dx, dy, c, s = other[0] - base[0], other[1] - base[1], math.cos(base[2]), math.sin(base[2])
    return c * dx + s * dy, c * dy - s * dx, math.remainder(other[2] - base[2], 2 * math.pi)


def _time(word: str) -> float:
    if not usable((value := _finite(word),), LATEST):
        raise ValueError(f"{word} is not a time")
    return value


def _finite(word: str) -> float:
    if not math.isfinite(value := float(word)):
        raise ValueError(f"{word} is not a number")
    return value


_LINES = {"ODOM": _odom, "FLASER": _flaser, "ROBOTLASER1": _robotlaser, "TRUEPOS": _truepos}
