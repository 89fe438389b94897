"""Evaluation of a localizer on the readings of a log: runs it, and compares its beliefs with reference poses."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.stack import StackSpec
from simscen.record.localization_logs.read import LocalizationLog
from simscen.record.localization_logs.rows import TICK_RATE_HZ
from simscen.stack.protocols import Surroundings
from simscen.stack.setting import Setting
from simscen.stack.validation.components import CheckedLocalizer

MAX_GAP_S = 1.0
"""Maximum time between two consecutive reference poses, so that all beliefs between the poses are compared."""
MAX_TIME_DIFFERENCE_S = 0.05
"""Maximum time between a belief and the nearest reference pose in a gap longer than MAX_GAP_S."""


@dataclass(frozen=True, eq=False)
class LocalizationResult:
    """Beliefs of a localizer on a log, one after each odometry message. CPU times are not deterministic.

    times:             times (n,) of the beliefs in s
    poses:             estimated poses (n, 3) in the map frame
    covariances:       covariances (n, 3, 3) of the poses
    scan_count:        number of processed scans
    cpu_s:             CPU time for all readings
    slowest_reading_s: CPU time for the slowest reading
    """

    times: Array
    poses: Array
    covariances: Array
    scan_count: int
    cpu_s: float
    slowest_reading_s: float


@dataclass(frozen=True)
class LostInterval:
    """Interval from `since` to `until` in s in which the robot was lost; `until` is None if it was lost to the end."""

    since: float
    until: float | None


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """Errors of a localizer's beliefs.

    times:    times (n,) in s
    distance: position errors (n,) in m
    yaw:      signed yaw errors (n,) in rad
    lost:     intervals in which the robot was lost
    compared_fraction: fraction of all beliefs that could be compared with a reference pose
    """

    times: Array
    distance: Array
    yaw: Array
    lost: Sequence[LostInterval]
    compared_fraction: float

    def figures(self) -> dict[str, float]:
        """Return by name the median, RMSE, largest, and last position error in m, and the RMSE of the yaw in rad."""
        return {
            "median": float(np.median(self.distance)),
            "rmse": float(np.sqrt(np.mean(self.distance**2))),
            "max": float(self.distance.max()),
            "final": float(self.distance[-1]),
            "yaw_rmse": float(np.sqrt(np.mean(self.yaw**2))),
        }


def localize(
    log: LocalizationLog, spec: StackSpec, surroundings: Surroundings, estimate: Estimate, seed: int
) -> LocalizationResult:
    """Pass all readings of a log to the localizer of a stack. `estimate` is the initial pose estimate."""
    localizer = CheckedLocalizer(spec.localizer, Setting(surroundings, "localizer", Streams(seed)))
    localizer.reset(estimate)
    times, poses, covariances, scan_count, cpu_s, slowest_s = [], [], [], 0, 0.0, 0.0
    for reading in log.readings:
        start = time.process_time()
        match reading:
            case Scan():
                localizer.on_scan(reading)
                scan_count += 1
            case Odometry():
                localizer.on_odometry(reading)
                times.append(reading.tick / TICK_RATE_HZ)
                poses.append(tuple(localizer.belief.pose))
                covariances.append(localizer.belief.covariance)
        elapsed = time.process_time() - start
        cpu_s, slowest_s = cpu_s + elapsed, max(slowest_s, elapsed)
    return LocalizationResult(np.array(times), np.array(poses), np.array(covariances), scan_count, cpu_s, slowest_s)


def compare_with_reference(
    localized: LocalizationResult, log: LocalizationLog, lost_distance: float
) -> PoseErrors | None:
    """Return the errors of beliefs against interpolated reference poses of the log; None if no belief can be compared.

    A belief in a gap longer than MAX_GAP_S is compared only within MAX_TIME_DIFFERENCE_S of a reference pose. The robot
    is lost while its position error exceeds `lost_distance` in m.
    """
    if len(log.ticks) < 2:
        return None
    known_times = log.ticks / TICK_RATE_HZ
    inside = (localized.times >= known_times[0]) & (localized.times <= known_times[-1])
    after = np.clip(np.searchsorted(known_times, localized.times), 1, len(known_times) - 1)
    near = (
        np.minimum(np.abs(known_times[after] - localized.times), np.abs(localized.times - known_times[after - 1]))
        <= MAX_TIME_DIFFERENCE_S
    )
    inside &= near | (known_times[after] - known_times[after - 1] <= MAX_GAP_S)
    times = localized.times[inside]
    if not len(times):
        return None
    yaw = np.unwrap(log.truth[:, 2])
    x, y, heading = (np.interp(times, known_times, values) for values in (*log.truth[:, :2].T, yaw))
    poses = localized.poses[inside]
    distance = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
    lost = lost_intervals(times, distance > lost_distance)
    return PoseErrors(times, distance, wrap_array(poses[:, 2] - heading), lost, len(times) / len(localized.times))


def lost_intervals(times: Array, lost: Array) -> list[LostInterval]:
    """Return the intervals of `times` (n,) in which `lost` (n,) is true. An interval ends when `lost` becomes false."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lost.astype(np.int8), [0]))))
    return [
        LostInterval(float(times[begin]), float(times[end]) if end < len(times) else None)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]
