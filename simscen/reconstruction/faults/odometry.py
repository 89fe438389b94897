"""Finds faults of wheel odometry and gyroscope by comparison with the true motion.

The scale of a sensor is the ratio of measured to true motion. Steps are the steps of MotionSteps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.gaps import pose_is_known
from simscen.reconstruction.drive.motion_steps import STEP_S, MotionSteps
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive
from simscen.reconstruction.reasons import FoundFault, Reason, Window, find_windows

MIN_DISTANCE_M, MIN_TURN_RAD = 1.0, 1.5
"""Minimum distance and turn of a drive for estimating the scales of distances and turns."""
MIN_SCALE_ERROR, MIN_TURN_SCALE_ERROR, MIN_TURN_RAD_PER_M = 0.02, 0.03, 0.008
"""Minimum deviations from 1 of reported scales of distances and turns, and minimum reported turn per meter."""
MIN_DRIFT_M_S, MIN_DRIFT_RAD_S = 0.01, 0.01
"""Minimum velocities of the odometry at rest that are reported as drift."""
MIN_SLIP_FRACTION, MIN_SLIP_STEP_M, MIN_SLIP_S = 0.08, 0.02, 1.0
"""Minimum part of the rolled distance that is lost in a step with slip (fraction, m), and minimum duration of slip."""
MIN_NOISE_M, MIN_TURN_NOISE_RAD = 0.05, 0.05
"""Minimum standard deviations of the odometry, after 1 m and after 1 rad, that are reported as noise."""
MIN_EXCESS_SLIP, MIN_ROLLED_M = 0.06, 0.3
"""Minimum difference between the lost fraction during slip and the lost fraction in the rest of the drive, and minimum
rolled distance for computing a lost fraction."""
REST_M, REST_RAD, MIN_REST_STEPS = 0.002, 0.002, 4
"""Maximum motion in a step at rest, and minimum number of steps at rest for estimating a drift."""
LONG_FRACTION = 0.75
"""Maximum duration of slip as a fraction of the drive. Longer slip is a scale of the odometry."""
CONFIDENCE_SIGMAS = 4.0
"""Minimum ratio of a reported estimate to its standard deviation."""


def odometry_faults(steps: MotionSteps, wheel_separation: float, skids: bool = False) -> Iterator[FoundFault]:
    """Yield the faults of the odometry.

    `wheel_separation` is the distance in m between left and right wheels. For a skid-steer robot (`skids`), a wrong
    scale of turns and noise are not reported.
    """
    if len(steps) < 6:
        return
    slip = list(_slip(steps, wheel_separation))
    yield from slip
    if not slip:
        yield from _systematic_faults(steps, skids)


def _slip(steps: MotionSteps, wheel_separation: float) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which the wheels rolled farther than the robot drove."""
    measured, true = (_wheel_distances(motion, wheel_separation) for motion in (steps.measured, steps.true))
    lost = np.abs(measured) - np.abs(true)
    slips = ((lost > MIN_SLIP_FRACTION * np.abs(measured)) & (lost > MIN_SLIP_STEP_M)).any(axis=1)
    for window in find_windows(np.asarray(slips), steps.times, max_gap=2.2 * STEP_S):
        whole = window.length > LONG_FRACTION * float(np.ptp(steps.times))
        if whole or window.length < MIN_SLIP_S:
            continue
        values = _slip_values(measured[window.samples], true[window.samples])
        outside = np.ones(len(steps), dtype=bool)
        outside[window.samples] = False
        excess = _lost_fraction(measured, true, ~outside) - _lost_fraction(measured, true, outside)
        if not values or excess < MIN_EXCESS_SLIP:
            continue
        before = steps.times < window.begin
        target = "odom" if _follows_commands(steps, window) else "wheels"
        text = "the wheels roll further than the robot drives"
        begin = None if not before.any() else window.begin
        reason = Reason(text, window.begin, window.end + STEP_S, "medium")
        yield FoundFault(target, "slip", values, begin, window.length + STEP_S, reason)


def _lost_fraction(measured: Array, true: Array, chosen: Mask) -> float:
    """Return the lost fraction of the rolled distances (n, 2) in the `chosen` steps (n,), for the worse side."""
    rolled = np.abs(measured[chosen]).sum(axis=0)
    lost = (np.abs(measured[chosen]) - np.abs(true[chosen])).sum(axis=0)
    return float((lost / np.maximum(rolled, 1e-6)).max()) if rolled.max() > MIN_ROLLED_M else 0.0


def _wheel_distances(motion: Array, wheel_separation: float) -> Array:
    """Return the distances (n, 2) in m that left and right wheels roll in motion steps (n, 3)."""
    half = motion[:, 2] * wheel_separation / 2
    return np.column_stack((motion[:, 0] - half, motion[:, 0] + half))


def _slip_values(measured: Array, true: Array) -> dict[str, object]:
    """Return the parameters of the fault `slip` from wheel distances (n, 2); {} without slip."""
    rolled = np.abs(measured).sum(axis=0)
    shares = 1.0 - (true * np.sign(measured)).sum(axis=0) / np.maximum(rolled, 1e-6)
    shares = np.clip(np.where(rolled > 0.1, shares, 0.0), 0.0, 0.95)
    if float(shares.max()) < MIN_SLIP_FRACTION:
        return {}
    return {"left": f"{100 * shares[0]:.0f} %", "right": f"{100 * shares[1]:.0f} %"}


def _follows_commands(steps: MotionSteps, window: Window) -> bool:
    """Return whether the true motion is closer to the commands than the odometry is."""
    commanded = float(np.abs(steps.commanded[window.samples][:, 0]).sum())
    true, measured = (float(np.abs(motion[window.samples][:, 0]).sum()) for motion in (steps.true, steps.measured))
    return commanded > 0.1 and abs(true - commanded) < abs(measured - commanded)


def _systematic_faults(steps: MotionSteps, skids: bool) -> Iterator[FoundFault]:
    """Yield faults of the whole drive: scale or bias by least squares, drift at rest, and noise."""
    measured, true = steps.measured, steps.true
    forward = _fit(true[:, :1], measured[:, 0])
    turn = _fit(true[:, [2, 0]], measured[:, 2])
    distance, turned = float(np.abs(true[:, 0]).sum()), float(np.abs(true[:, 2]).sum())
    linear = forward[0][0] - 1.0 if distance > MIN_DISTANCE_M else 0.0
    angular = turn[0][0] - 1.0 if turned > MIN_TURN_RAD and not skids else 0.0
    per_meter = turn[0][1] if distance > MIN_DISTANCE_M else 0.0
    is_linear = abs(linear) > max(MIN_SCALE_ERROR, CONFIDENCE_SIGMAS * forward[1][0])
    is_angular = abs(angular) > max(MIN_TURN_SCALE_ERROR, CONFIDENCE_SIGMAS * turn[1][0])
    is_curved = abs(per_meter) > max(MIN_TURN_RAD_PER_M, CONFIDENCE_SIGMAS * turn[1][1])
    drive = float(steps.times[0]), float(steps.times[-1]) + STEP_S
    if is_linear and is_angular and abs(linear - angular) < 0.3 * abs(linear) and not is_curved:
        text = f"the odometry reports {100 * (1 + linear):.1f} % of the motion"
        yield FoundFault("odom", "scale", {"factor": f"{100 * (1 + linear):.1f} %"}, reason=Reason(text, *drive))
    elif is_linear or is_angular or is_curved:
        values: dict[str, object] = {}
        values |= {"linear_scale": round(float(1 + linear), 3)} if is_linear else {}
        values |= {"angular_scale": round(float(1 + angular), 3)} if is_angular else {}
        values |= {"turn_per_metre": f"{math.degrees(per_meter):.2f} deg"} if is_curved else {}
        text = (
            f"the odometry reports {100 * (1 + linear):.1f} % of the distance and {100 * (1 + angular):.1f} % of turns"
        )
        text += f", and turns by {math.degrees(per_meter):.2f} deg per meter" if is_curved else ""
        yield FoundFault("odom", "bias", values, reason=Reason(text, *drive))
    yield from _drift(steps)
    if not skids:
        yield from _noise(steps, forward[2], turn[2], drive)


def _fit(matrix: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return the least-squares solution (k,), its standard deviations (k,), and the predicted values (n,)."""
    solution: Array = np.asarray(np.linalg.lstsq(matrix, values, rcond=None)[0], dtype=np.float64)
    predicted: Array = np.asarray(matrix @ solution, dtype=np.float64)
    variance = float(np.sum((values - predicted) ** 2)) / max(1, len(values) - matrix.shape[1])
    covariance = variance * np.linalg.pinv(matrix.T @ matrix)
    deviations: Array = np.sqrt(np.maximum(np.diag(covariance), 0.0)).astype(np.float64)
    return solution, deviations, predicted


def _drift(steps: MotionSteps) -> Iterator[FoundFault]:
    """Yield a fault if the odometry reports motion while the robot stands."""
    rest = (np.abs(steps.true[:, :2]).max(axis=1) < REST_M) & (np.abs(steps.true[:, 2]) < REST_RAD)
    # While an obstacle blocks a robot that is commanded to drive, its wheels spin. This is slip, not drift.
    rest &= np.abs(steps.commanded).max(axis=1) < REST_M
    if int(rest.sum()) < MIN_REST_STEPS:
        return
    linear, _, angular = (np.median(steps.measured[rest], axis=0) / STEP_S).tolist()
    values: dict[str, object] = {}
    values |= {"linear": f"{linear:.3f} m/s"} if abs(linear) > MIN_DRIFT_M_S else {}
    values |= {"angular": f"{angular:.3f} rad/s"} if abs(angular) > MIN_DRIFT_RAD_S else {}
    if values:
        times = steps.times[rest]
        reason = Reason("the odometry moves while the robot stands", float(times[0]), float(times[-1]))
        yield FoundFault("odom", "drift", values, reason=reason)


def _noise(steps: MotionSteps, forward_fit: Array, turn_fit: Array, drive: tuple[float, float]) -> Iterator[FoundFault]:
    """Yield a fault if the measured motion scatters about the fitted distances and turns (n,).

    `drive` is the start and the end of the drive in s.
    """
    values: dict[str, object] = {}
    distance, turned = steps.true[:, 0], steps.true[:, 2]
    moved, rotated = np.abs(distance) > 0.05, np.abs(turned) > 0.05
    if moved.sum() >= 8:
        linear = float(np.std((steps.measured[:, 0] - forward_fit)[moved] / np.sqrt(np.abs(distance[moved]))))
        values |= {"linear": f"{100 * linear:.1f} cm"} if linear > MIN_NOISE_M else {}
    if rotated.sum() >= 8:
        angular = float(np.std((steps.measured[:, 2] - turn_fit)[rotated] / np.sqrt(np.abs(turned[rotated]))))
        values |= {"angular": f"{math.degrees(angular):.1f} deg"} if angular > MIN_TURN_NOISE_RAD else {}
    if values:
        text = "the steps of the odometry scatter about the true motion"
        yield FoundFault("odom", "noise", values, reason=Reason(text, *drive, "low"))


BIN_S, MIN_BINS = 0.5, 8
"""Length of the bins over which turn rates are averaged, and minimum number of bins for an estimate."""
MIN_BIAS_RAD_S, MIN_DRIFTED_RAD_S = 0.006, 0.006
"""Minimum reported bias, and minimum change of the bias by a reported drift."""
MIN_GYRO_SCALE_ERROR, MIN_GYRO_TURN_RAD = 0.03, 2.0
"""Minimum deviation of a reported scale from 1, and minimum total turn for estimating the scale."""
MAX_RATE_CHANGE_RAD_S = 0.2
"""Maximum change of the turn rate between bins that are used for estimating a bias or a drift."""
MIN_RAMP_S, MIN_RAMP_SIGMAS = 4.0, 4.0
"""Minimum duration of a drift, and minimum change by the drift in standard deviations of the remaining errors."""
MAX_ERROR_RATIO = 0.2
"""A drift or a scale is reported if it reduces the sum of squared errors to less than this fraction."""


def gyroscope_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield at most one fault of the gyroscope: a wrong scale, a drift, or a bias."""
    times, measured, true = _turn_rates(drive)
    if len(times) < MIN_BINS:
        return
    turned = float(np.abs(true).sum() * BIN_S)
    scale = float(true @ measured) / max(float(true @ true), 1e-9) if turned > MIN_GYRO_TURN_RAD else 1.0
    explained = float(np.sum((measured - scale * true) ** 2)) < MAX_ERROR_RATIO * float(np.sum((measured - true) ** 2))
    if abs(scale - 1.0) > MIN_GYRO_SCALE_ERROR and explained:
        text = f"the gyroscope reports {100 * scale:.1f} % of the turns"
        yield FoundFault("imu", "scale", {"factor": f"{100 * scale:.1f} %"}, reason=Reason(text, float(times[0])))
        return
    change = np.abs(np.diff(true, prepend=true[0], append=true[-1]))
    steady = np.maximum(change[1:], change[:-1]) < MAX_RATE_CHANGE_RAD_S
    times, errors = times[steady], (measured - true)[steady]
    if len(times) < MIN_BINS:
        return
    bias = float(np.median(errors))
    begin, end, slope, remaining = _fit_ramp(times, errors)
    constant = float(np.sum((errors - errors.mean()) ** 2))
    scatter = math.sqrt(remaining / max(1, len(times) - 4))
    grown = abs(slope) * (end - begin)
    if grown > max(MIN_DRIFTED_RAD_S, MIN_RAMP_SIGMAS * scatter) and remaining < MAX_ERROR_RATIO * constant:
        text = f"the bias of the gyroscope grows by {slope:.5f} rad/s per second"
        whole = end >= float(times[-1]) - BIN_S
        from_start = begin <= float(times[0]) + BIN_S
        values = {"gyro": f"{slope:.5f} rad/s^2"}
        reason = Reason(text, begin, end, "medium")
        length = None if whole else end - begin
        yield FoundFault("imu", "drift", values, None if from_start else begin, length, reason)
    elif abs(bias) > MIN_BIAS_RAD_S:
        text = f"the gyroscope reports {bias:.4f} rad/s at rest"
        yield FoundFault("imu", "bias", {"gyro": f"{bias:.4f} rad/s"}, reason=Reason(text, float(times[0])))


def _turn_rates(drive: RecordedDrive) -> tuple[Array, Array, Array]:
    """Return the start times (n,) of bins in s, and the mean turn rates (n,) in rad/s of gyroscope and true poses."""
    imu = drive.turn_rates
    if len(imu) < 2 or len(drive.poses) < 2 or imu.times[-1] - imu.times[0] <= BIN_S:
        return np.empty(0), np.empty(0), np.empty(0)
    edges = np.arange(float(imu.times[0]), float(imu.times[-1]), BIN_S)
    index = np.searchsorted(edges, imu.times, side="right") - 1
    inside = (index >= 0) & (index < len(edges) - 1)
    count = np.bincount(index[inside], minlength=len(edges) - 1)
    total = np.bincount(index[inside], imu.values[inside, 0], minlength=len(edges) - 1)
    yaw = np.unwrap(drive.poses.poses_at(edges)[:, 2])
    known = pose_is_known(drive, edges)
    kept = (count > 0) & known[:-1] & known[1:]
    return edges[:-1][kept], total[kept] / count[kept], (np.diff(yaw) / BIN_S)[kept]


def _fit_ramp(times: Array, errors: Array) -> tuple[float, float, float, float]:
    """Fit a ramp to `errors` (n,) in rad/s. Return start and end in s, slope in rad/s², and sum of squared errors."""
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
