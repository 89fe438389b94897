"""A recorded drive through the localizer alone: how far its belief is from a reference."""

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
from simscen.stack.plugins.checked_components import CheckedLocalizer
from simscen.stack.protocols import Surroundings
from simscen.stack.setting import Setting

LONGEST_GAP = TICK_RATE_HZ
"""Ticks between two poses of the reference above which nothing is said in between."""
NEAR_S = 0.05
"""A belief this near in time to a pose of the reference is compared with it, whatever the gaps."""


@dataclass(frozen=True, eq=False)
class Localized:
    """What the localizer believed: `times` (n,) in s and `poses` (n, 3) in the map; `scans` were used.

    `covariances` (n, 3, 3) are those of the poses. `cpu` is the processor's time in s that all of it took, and
    `slowest` that of the scan that took longest, which no two runs share.
    """

    times: Array
    poses: Array
    covariances: Array
    scans: int
    cpu: float
    slowest: float


@dataclass(frozen=True)
class Lost:
    """The belief was further off than allowed from a time in s on, `until` it was not; None = to the end."""

    since: float
    until: float | None


@dataclass(frozen=True, eq=False)
class Errors:
    """Distances (n,) in m and heading errors (n,) in rad at `times` (n,) in s, and when the robot was lost.

    `compared` is the share of all beliefs for which the reference says something.
    """

    times: Array
    distance: Array
    yaw: Array
    lost: Sequence[Lost]
    compared: float

    def figures(self) -> dict[str, float]:
        """Median, RMSE, largest and last distance in m; RMSE of the heading in rad."""
        off = self.distance
        return {
            "median": float(np.median(off)),
            "rmse": float(np.sqrt(np.mean(off**2))),
            "max": float(off.max()),
            "final": float(off[-1]),
            "yaw_rmse": float(np.sqrt(np.mean(self.yaw**2))),
        }


def localize(
    sensed: LocalizationLog, spec: StackSpec, surroundings: Surroundings, estimate: Estimate, seed: int
) -> Localized:
    """Feed a log to the localizer of a stack, reading by reading; the belief is taken after each odometry.

    The same arguments give the same beliefs, and those of a run of that seed: the localizer is begun as a stack does.
    """
    localizer = CheckedLocalizer(spec.localizer, Setting(surroundings, "localizer", Streams(seed)))
    localizer.reset(estimate)
    times, poses, covariances, scans, cpu, slowest = [], [], [], 0, 0.0, 0.0
    for reading in sensed.readings:
        began = time.process_time()
        match reading:
            case Scan():
                localizer.on_scan(reading)
                scans += 1
            case Odometry():
                localizer.on_odometry(reading)
                times.append(reading.tick / TICK_RATE_HZ)
                poses.append(tuple(localizer.belief.pose))
                covariances.append(localizer.belief.covariance)
        took = time.process_time() - began
        cpu, slowest = cpu + took, max(slowest, took)
    return Localized(np.array(times), np.array(poses), np.array(covariances), scans, cpu, slowest)


def errors_of(localized: Localized, sensed: LocalizationLog, far: float) -> Errors | None:
    """How far off the belief was wherever the reference says something; None where it never does.

    The reference is interpolated, not over gaps; within a gap, only beliefs at its ends count.
    The robot is lost where the belief is more than `far` m off.
    """
    if len(sensed.ticks) < 2:
        return None
    known = sensed.ticks / TICK_RATE_HZ
    inside = (localized.times >= known[0]) & (localized.times <= known[-1])
    after = np.clip(np.searchsorted(known, localized.times), 1, len(known) - 1)
    near = np.minimum(np.abs(known[after] - localized.times), np.abs(localized.times - known[after - 1])) <= NEAR_S
    inside &= near | (known[after] - known[after - 1] <= LONGEST_GAP / TICK_RATE_HZ)
    times = localized.times[inside]
    if not len(times):
        return None
    yaw = np.unwrap(sensed.truth[:, 2])
    x, y, heading = (np.interp(times, known, values) for values in (*sensed.truth[:, :2].T, yaw))
    poses = localized.poses[inside]
    distance = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
    return Errors(
        times,
        distance,
        wrap_array(poses[:, 2] - heading),
        lost_times(times, distance > far),
        len(times) / len(localized.times),
    )


def lost_times(times: Array, far: Array) -> list[Lost]:
    """The stretches in which the robot was lost."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], far.astype(np.int8), [0]))))
    return [
        Lost(float(times[begin]), float(times[end]) if end < len(times) else None)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]
