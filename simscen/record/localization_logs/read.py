"""What a robot measured, out of any log, and where it truly was if the log knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.localization_logs.rosbag import read_rosbag_rows
from simscen.record.localization_logs.rows import TICK_RATE_HZ, LocalizationRows, ScanRow
from simscen.record.localization_logs.text_logs import read_carmen_rows, read_csv_rows
from simscen.record.log_reader.read import LOG_READ_ERRORS, invalid_log


@dataclass(frozen=True, eq=False)
class LocalizationLog:
    """`readings` in the order in which the robot received them; `truth` (n, 3) x, y, yaw in the map at `ticks` (n,).

    Ticks are of 1/TICK_RATE s, from the log's first reading on. `notes` are what is odd about the log. `told` is where
    the robot was when the odometry began, by the first thing that somebody told it.
    """

    readings: Sequence[Odometry | Scan]
    ticks: Ticks
    truth: Array
    notes: Sequence[str] = ()
    told: Pose2 | None = None


def read_localization_log(path: Path, odometry: str, scan: str, reference: str | None) -> LocalizationLog:
    """Read odometry, scans and a reference from a rosbag2 folder, an MCAP file, a CARMEN log or a CSV file.

    The topics matter for ROS alone; without `reference`, what simscen's own logs, CARMEN's TRUEPOS and the rows called
    `truth` of a CSV file say counts. Raises InvalidInput for what cannot be used.
    """
    try:
        if path.suffix == ".csv":
            rows = read_csv_rows(path)
        elif path.suffix in (".log", ".clf", ".carmen"):
            rows = read_carmen_rows(path)
        else:
            rows = read_rosbag_rows(path, odometry, scan, reference)
        for kind, told in (("odometry", rows.odometry), ("scans", rows.scans)):
            if not told:
                raise UnusableLog(f"it holds no {kind}", rows.hint)
        return _to_log(rows)
    except UnusableLog as error:
        raise invalid_log(path, "SC804", str(error), error.hint) from error
    except UnicodeDecodeError as error:
        raise invalid_log(path, "SC802", "the log is not text") from error
    except OSError as error:
        raise invalid_log(path, "SC800", f"cannot read the log: {error.strerror or error}") from error
    except LOG_READ_ERRORS as error:
        raise invalid_log(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error


def _to_log(rows: LocalizationRows) -> LocalizationLog:
    start = min(*(row.time for row in rows.odometry), *(row.time for row in rows.scans))

    def tick(time: float) -> int:
        return round((time - start) * TICK_RATE_HZ)

    told: list[tuple[int, int, Odometry | Scan]] = [
        (row.order, 0, Odometry("odom", tick(row.time), Pose2(*row.pose), Twist())) for row in rows.odometry
    ]
    told += [(row.order, 1, _scan(row, tick(row.time))) for row in rows.scans]
    told.sort(key=lambda one: one[:2])
    truth = {tick(row.time): row.pose for row in rows.truth}
    ticks = np.array(sorted(truth), dtype=np.int64)
    poses = np.array([truth[int(one)] for one in ticks], dtype=np.float64).reshape(-1, 3)
    readings = [one for *_, one in told]
    return LocalizationLog(readings, ticks, poses, [*rows.notes, *_check_readings(readings)], _initial_pose(rows))


def _initial_pose(rows: LocalizationRows) -> Pose2 | None:
    """Where the robot was when the odometry began, if it has driven as that says until it was told where it is."""
    if not rows.initial:
        return None
    first = min(rows.initial, key=lambda one: one.order)
    near = min(rows.odometry, key=lambda one: abs(one.time - first.time))
    return Pose2(*first.pose).compose(Pose2(*near.pose).between(Pose2(*rows.odometry[0].pose)))


def _check_readings(readings: Sequence[Odometry | Scan]) -> Iterator[str]:
    """Readings that no localizer can use. Raises Unusable where that is every scan."""
    taken = [one for one in readings if isinstance(one, Scan)]
    if any(one.angle_increment == 0.0 and len(one.ranges) > 1 for one in taken):
        raise UnusableLog("all beams of a scan look the same way: its angle_increment is 0")
    if blind := sum(not len(one.points()) for one in taken):
        yield f"{blind} of {len(taken)} scans measured nothing within their range_min and range_max"
    odometry = np.array([one.tick for one in readings if isinstance(one, Odometry)])
    scans = np.array([one.tick for one in readings if isinstance(one, Scan)])
    if late := int((np.diff(np.maximum.accumulate(odometry)) == 0).sum()):
        yield f"{late} of {len(odometry)} odometry readings are not newer than one before, and count for nothing"
    outside = int(((scans < odometry[0]) | (scans > odometry.max())).sum())
    if outside == len(scans):
        raise UnusableLog("no scan was taken while there was odometry", "their clocks differ, or a topic is another's")
    if outside:
        yield f"{outside} of {len(scans)} scans were taken before the odometry begins or after it ends"


def _scan(row: ScanRow, tick: int) -> Scan:
    first, increment, least, most = row.layout
    return Scan("lidar", tick, row.ranges, first, increment, least, most, Pose2(*row.mount))
