"""Faults of the gyroscope: bias, drift, and scale, from its difference to the turn rate of the robot."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.evidence import Evidence, FoundFault

BIN_S, MIN_BINS = 0.5, 8
"""Length of the intervals over which turn rates are averaged, and number of intervals that an estimate needs."""
MIN_BIAS_RAD_S, MIN_DRIFTED_RAD_S = 0.006, 0.006
"""Smallest bias, and smallest change of the bias by drift, that are reported."""
MIN_SCALE_ERROR, MIN_TURN_RAD = 0.03, 2.0
"""Smallest difference of the scale from 1 that is reported, and total turn that its estimate needs."""
MAX_RATE_CHANGE_RAD_S = 0.2
"""Change of the turn rate between two bins above which small errors of the times would look like errors of the rate."""
MIN_RAMP_S, MIN_RAMP_SIGMAS = 4.0, 4.0
"""Shortest duration of a drift, and its smallest change in standard deviations of the remaining errors."""
MAX_ERROR_RATIO = 0.2
"""Share of the squared error below which a drift, or a scale, explains the differences better than a constant."""


def gyroscope_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield the faults of the gyroscope."""
    times, measured, true = _turn_rates(drive)
    if len(times) < MIN_BINS:
        return
    turned = float(np.abs(true).sum() * BIN_S)
    scale = float(true @ measured) / max(float(true @ true), 1e-9) if turned > MIN_TURN_RAD else 1.0
    explained = float(np.sum((measured - scale * true) ** 2)) < MAX_ERROR_RATIO * float(np.sum((measured - true) ** 2))
    if abs(scale - 1.0) > MIN_SCALE_ERROR and explained:
        text = f"the gyroscope reports {100 * scale:.1f} % of the turns"
        yield FoundFault("imu", "scale", {"factor": f"{100 * scale:.1f} %"}, evidence=Evidence(text, float(times[0])))
        return
    change = np.abs(np.diff(true, prepend=true[0], append=true[-1]))
    steady = np.maximum(change[1:], change[:-1]) < MAX_RATE_CHANGE_RAD_S
    times, errors = times[steady], (measured - true)[steady]
    if len(times) < MIN_BINS:
        return
    bias = float(np.median(errors))
    begin, end, slope, remaining = _ramp(times, errors)
    constant = float(np.sum((errors - errors.mean()) ** 2))
    scatter = math.sqrt(remaining / max(1, len(times) - 4))
    grown = abs(slope) * (end - begin)
    if grown > max(MIN_DRIFTED_RAD_S, MIN_RAMP_SIGMAS * scatter) and remaining < MAX_ERROR_RATIO * constant:
        text = f"the bias of the gyroscope grows by {slope:.5f} rad/s per second"
        whole = end >= float(times[-1]) - BIN_S
        from_start = begin <= float(times[0]) + BIN_S
        values = {"gyro": f"{slope:.5f} rad/s^2"}
        evidence = Evidence(text, begin, end, "medium")
        length = None if whole else end - begin
        yield FoundFault("imu", "drift", values, None if from_start else begin, length, evidence)
    elif abs(bias) > MIN_BIAS_RAD_S:
        text = f"the gyroscope reports {bias:.4f} rad/s at rest"
        yield FoundFault("imu", "bias", {"gyro": f"{bias:.4f} rad/s"}, evidence=Evidence(text, float(times[0])))


def _turn_rates(drive: RecordedDrive) -> tuple[Array, Array, Array]:
    """Return times (n,) of bins of BIN_S with the mean turn rates in rad/s that the gyroscope and the poses show."""
    imu = drive.turn_rates
    if len(imu) < 2 or len(drive.poses) < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    edges = np.arange(float(imu.times[0]), float(imu.times[-1]), BIN_S)
    if len(edges) < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    index = np.searchsorted(edges, imu.times, side="right") - 1
    inside = (index >= 0) & (index < len(edges) - 1)
    count = np.bincount(index[inside], minlength=len(edges) - 1)
    total = np.bincount(index[inside], imu.values[inside, 0], minlength=len(edges) - 1)
    yaw = np.unwrap(drive.poses.poses_at(edges)[:, 2])
    kept = count > 0
    return edges[:-1][kept], total[kept] / count[kept], (np.diff(yaw) / BIN_S)[kept]


def _ramp(times: Array, errors: Array) -> tuple[float, float, float, float]:
    """Return begin, end, slope, and remaining squared error of the ramp from zero that fits the errors best."""
    best = (float(times[0]), float(times[-1]), 0.0, float(np.sum((errors - errors.mean()) ** 2)))
    stride = max(1, len(times) // 40)
    for first in range(0, len(times) - MIN_BINS // 2, stride):
        for last in range(first + MIN_BINS // 2, len(times) + 1, stride):
            if times[last - 1] - times[first] < MIN_RAMP_S:
                continue
            ramp = np.zeros(len(times))
            ramp[first:last] = times[first:last] - times[first]
            matrix = np.column_stack((ramp, np.ones(len(times))))
            solution, *_ = np.linalg.lstsq(matrix, errors, rcond=None)
            rest = float(np.sum((errors - matrix @ solution) ** 2))
            if rest < best[3]:
                best = (float(times[first]), float(times[last - 1]) + BIN_S, float(solution[0]), rest)
    return best
