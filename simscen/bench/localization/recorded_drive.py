"""Evaluate a localizer on a log: pass it the recorded readings, and compare its beliefs with reference poses."""

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
from simscen.stack.checked_components import CheckedLocalizer
from simscen.stack.protocols import Surroundings
from simscen.stack.setting import Setting

MAX_GAP_S = 1.0
"""Maximum time between two reference poses for interpolation between them."""
MAX_TIME_DIFFERENCE_S = 0.05
"""In a longer gap, only beliefs within this time of a reference pose are compared."""


@dataclass(frozen=True, eq=False)
class Localized:
    """Beliefs of a localizer on a log: `times` (n,) in s, `poses` (n, 3) in the map frame, and `covariances` (n, 3, 3).

    `scans` is the number of processed scans. `cpu` is the CPU time in s for all readings, and `slowest` that for the
    slowest reading. CPU times differ each time; everything else is deterministic.
    """

    times: Array
    poses: Array
    covariances: Array
    scans: int
    cpu: float
    slowest: float


@dataclass(frozen=True)
class LostInterval:
    """Interval in s in which the error exceeded the limit; `until` is None if it lasts to the end."""

    since: float
    until: float | None


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of a localizer at `times` (n,) in s: `distance` (n,) in m and signed `yaw` (n,) in rad.

    `lost` are the intervals in which the robot was lost. `compared` is the fraction of the localizer's beliefs that
    could be compared with the reference.
    """

    times: Array
    distance: Array
    yaw: Array
    lost: Sequence[LostInterval]
    compared: float

    def figures(self) -> dict[str, float]:
        """Return median, RMSE, largest and last position error in m, and the RMSE of the yaw in rad, by name."""
        return {
            "median": float(np.median(self.distance)),
            "rmse": float(np.sqrt(np.mean(self.distance**2))),
            "max": float(self.distance.max()),
            "final": float(self.distance[-1]),
            "yaw_rmse": float(np.sqrt(np.mean(self.yaw**2))),
        }


def localize(
    log: LocalizationLog, spec: StackSpec, surroundings: Surroundings, estimate: Estimate, seed: int
) -> Localized:
    """Pass all readings of a log to the localizer of a stack, and return its belief after each odometry message.

    `estimate` is the initial pose estimate. The beliefs are the same as in a run with the same readings and seed.
    """
    localizer = CheckedLocalizer(spec.localizer, Setting(surroundings, "localizer", Streams(seed)))
    localizer.reset(estimate)
    times, poses, covariances, scans, cpu, slowest = [], [], [], 0, 0.0, 0.0
    for reading in log.readings:
        start = time.process_time()
        match reading:
            case Scan():
                localizer.on_scan(reading)
                scans += 1
            case Odometry():
                localizer.on_odometry(reading)
                times.append(reading.tick / TICK_RATE_HZ)
                poses.append(tuple(localizer.belief.pose))
                covariances.append(localizer.belief.covariance)
        elapsed = time.process_time() - start
        cpu, slowest = cpu + elapsed, max(slowest, elapsed)
    return Localized(np.array(times), np.array(poses), np.array(covariances), scans, cpu, slowest)


def compare_with_reference(localized: Localized, log: LocalizationLog, lost_distance: float) -> Errors | None:
    """Return the errors of the beliefs that can be compared with the true poses of the log; None if there are none.

    The true poses are interpolated, except over gaps longer than MAX_GAP_S. The robot is lost while the position error
    exceeds `lost_distance` in m.
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
    return Errors(times, distance, wrap_array(poses[:, 2] - heading), lost, len(times) / len(localized.times))


def lost_intervals(times: Array, lost: Array) -> list[LostInterval]:
    """Return the intervals of `times` (n,) in which `lost` (n,) is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lost.astype(np.int8), [0]))))
    return [
        LostInterval(float(times[begin]), float(times[end]) if end < len(times) else None)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]
