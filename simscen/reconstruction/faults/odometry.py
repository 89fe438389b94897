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

MIN_STEPS = 6
"""Minimum number of steps of a drive for finding faults of the odometry."""
MIN_DISTANCE_M, MIN_TURN_RAD = 1.0, 1.5
"""Minimum distance and turn of a drive for estimating the scales of distances and turns."""
MIN_SCALE_ERROR, MIN_TURN_SCALE_ERROR, MIN_TURN_RAD_PER_M = 0.02, 0.03, 0.008
"""Minimum deviations from 1 of reported scales of distances and turns, and minimum reported turn per meter."""
MIN_DRIFT_M_S, MIN_DRIFT_RAD_S = 0.01, 0.01
"""Minimum velocities of the odometry at rest that are reported as drift."""
MIN_SLIP_FRACTION, MIN_SLIP_STEP_M = 0.08, 0.02
"""Minimum lost part of the rolled distance in a step with slip: a fraction and a distance, which must both be lost."""
MIN_SLIP_S = 1.0
"""Minimum duration of slip."""
MIN_NOISE_M, MIN_TURN_NOISE_RAD = 0.05, 0.05
"""Minimum standard deviations of the odometry, after 1 m and after 1 rad, that are reported as noise."""
MIN_EXCESS_SLIP = 0.06
"""Minimum difference between the lost fraction during slip and the lost fraction in the other steps of the drive."""
MIN_ROLLED_M = 0.3
"""Minimum rolled distance for computing a lost fraction."""
MAX_REST_M, MAX_REST_RAD, MIN_REST_STEPS = 0.002, 0.002, 4
"""Maximum motion in a step at rest, and minimum number of steps at rest for estimating a drift."""
MAX_SLIP_DRIVE_FRACTION = 0.75
"""Maximum duration of slip as a fraction of the drive. Longer slip is a wrong scale of the odometry."""
CONFIDENCE_SIGMAS = 4.0
"""Minimum ratio of a reported estimate to its standard deviation."""


def odometry_faults(steps: MotionSteps, wheel_separation: float, skids: bool = False) -> Iterator[FoundFault]:
    """Yield the faults of the odometry.

    `wheel_separation` is the distance in m between left and right wheels. For a skid-steer robot (`skids`), a wrong
    scale of turns and noise are not reported.
    """
    if len(steps) < MIN_STEPS:
        return
    slip_faults = list(_slip_faults(steps, wheel_separation))
    yield from slip_faults
    if not slip_faults:
        yield from _systematic_faults(steps, skids)


def _slip_faults(steps: MotionSteps, wheel_separation: float) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which the wheels rolled farther than the robot drove."""
    measured, true = (_wheel_distances(motion, wheel_separation) for motion in (steps.measured, steps.true))
    lost = np.abs(measured) - np.abs(true)
    is_slipping = ((lost > MIN_SLIP_FRACTION * np.abs(measured)) & (lost > MIN_SLIP_STEP_M)).any(axis=1)
    for window in find_windows(np.asarray(is_slipping), steps.times, max_gap=2.2 * STEP_S):
        is_too_long = window.length > MAX_SLIP_DRIVE_FRACTION * float(np.ptp(steps.times))
        if is_too_long or window.length < MIN_SLIP_S:
            continue
        values = _slip_values(measured[window.samples], true[window.samples])
        is_outside = np.ones(len(steps), dtype=bool)
        is_outside[window.samples] = False
        excess = _lost_fraction(measured, true, ~is_outside) - _lost_fraction(measured, true, is_outside)
        if not values or excess < MIN_EXCESS_SLIP:
            continue
        has_steps_before = bool((steps.times < window.begin).any())
        target = "odom" if _follows_commands(steps, window) else "wheels"
        text = "the wheels roll further than the robot drives"
        begin = window.begin if has_steps_before else None
        reason = Reason(text, window.begin, window.end + STEP_S, "medium")
        yield FoundFault(target, "slip", values, begin, window.length + STEP_S, reason)


def _lost_fraction(measured: Array, true: Array, is_selected: Mask) -> float:
    """Return the lost fraction of the rolled distances of the worse side.

    `measured` and `true` are wheel distances (n, 2). `is_selected` (n,) is a mask of the steps that count.
    """
    rolled = np.abs(measured[is_selected]).sum(axis=0)
    lost = (np.abs(measured[is_selected]) - np.abs(true[is_selected])).sum(axis=0)
    return float((lost / np.maximum(rolled, 1e-6)).max()) if rolled.max() > MIN_ROLLED_M else 0.0


def _wheel_distances(motion: Array, wheel_separation: float) -> Array:
    """Return the distances (n, 2) in m that left and right wheels roll in motion steps (n, 3)."""
    half_difference = motion[:, 2] * wheel_separation / 2
    return np.column_stack((motion[:, 0] - half_difference, motion[:, 0] + half_difference))


def _slip_values(measured: Array, true: Array) -> dict[str, object]:
    """Return the parameters of the fault `slip` from wheel distances (n, 2); {} without slip."""
    rolled = np.abs(measured).sum(axis=0)
    fractions = 1.0 - (true * np.sign(measured)).sum(axis=0) / np.maximum(rolled, 1e-6)
    fractions = np.clip(np.where(rolled > 0.1, fractions, 0.0), 0.0, 0.95)
    if float(fractions.max()) < MIN_SLIP_FRACTION:
        return {}
    return {"left": f"{100 * fractions[0]:.0f} %", "right": f"{100 * fractions[1]:.0f} %"}


def _follows_commands(steps: MotionSteps, window: Window) -> bool:
    """Return whether the commands are closer to the true motion than to the odometry in a time window."""
    commanded = float(np.abs(steps.commanded[window.samples][:, 0]).sum())
    true, measured = (float(np.abs(motion[window.samples][:, 0]).sum()) for motion in (steps.true, steps.measured))
    return commanded > 0.1 and abs(true - commanded) < abs(measured - commanded)


def _systematic_faults(steps: MotionSteps, skids: bool) -> Iterator[FoundFault]:
    """Yield faults of the whole drive: scale or bias by least squares, drift at rest, and noise."""
    measured, true = steps.measured, steps.true
    distance_solution, distance_std, predicted_distances = _fit(true[:, :1], measured[:, 0])
    turn_solution, turn_std, predicted_turns = _fit(true[:, [2, 0]], measured[:, 2])
    total_distance, total_turn = float(np.abs(true[:, 0]).sum()), float(np.abs(true[:, 2]).sum())
    scale_error = distance_solution[0] - 1.0 if total_distance > MIN_DISTANCE_M else 0.0
    turn_scale_error = turn_solution[0] - 1.0 if total_turn > MIN_TURN_RAD and not skids else 0.0
    turn_per_meter = turn_solution[1] if total_distance > MIN_DISTANCE_M else 0.0
    has_scale = abs(scale_error) > max(MIN_SCALE_ERROR, CONFIDENCE_SIGMAS * distance_std[0])
    has_turn_scale = abs(turn_scale_error) > max(MIN_TURN_SCALE_ERROR, CONFIDENCE_SIGMAS * turn_std[0])
    is_curved = abs(turn_per_meter) > max(MIN_TURN_RAD_PER_M, CONFIDENCE_SIGMAS * turn_std[1])
    drive_times = float(steps.times[0]), float(steps.times[-1]) + STEP_S
    distance_percent, turn_percent = 100 * (1 + scale_error), 100 * (1 + turn_scale_error)
    are_similar = abs(scale_error - turn_scale_error) < 0.3 * abs(scale_error)
    if has_scale and has_turn_scale and are_similar and not is_curved:
        text = f"the odometry reports {distance_percent:.1f} % of the motion"
        reason = Reason(text, *drive_times)
        yield FoundFault("odom", "scale", {"factor": f"{distance_percent:.1f} %"}, reason=reason)
    elif has_scale or has_turn_scale or is_curved:
        values: dict[str, object] = {}
        values |= {"linear_scale": round(float(1 + scale_error), 3)} if has_scale else {}
        values |= {"angular_scale": round(float(1 + turn_scale_error), 3)} if has_turn_scale else {}
        values |= {"turn_per_metre": f"{math.degrees(turn_per_meter):.2f} deg"} if is_curved else {}
        text = f"the odometry reports {distance_percent:.1f} % of the distance and {turn_percent:.1f} % of turns"
        text += f", and turns by {math.degrees(turn_per_meter):.2f} deg per meter" if is_curved else ""
        yield FoundFault("odom", "bias", values, reason=Reason(text, *drive_times))
    yield from _drift_fault(steps)
    if not skids:
        yield from _noise_fault(steps, predicted_distances, predicted_turns, drive_times)


def _fit(matrix: Array, values: Array) -> tuple[Array, Array, Array]:
    """Fit `matrix` (n, k) times a solution to `values` (n,) by least squares.

    Return the solution (k,), its standard deviations (k,), and the predicted values (n,).
    """
    solution: Array = np.asarray(np.linalg.lstsq(matrix, values, rcond=None)[0], dtype=np.float64)
    predicted: Array = np.asarray(matrix @ solution, dtype=np.float64)
    variance = float(np.sum((values - predicted) ** 2)) / max(1, len(values) - matrix.shape[1])
    covariance = variance * np.linalg.pinv(matrix.T @ matrix)
    deviations: Array = np.sqrt(np.maximum(np.diag(covariance), 0.0)).astype(np.float64)
    return solution, deviations, predicted


def _drift_fault(steps: MotionSteps) -> Iterator[FoundFault]:
    """Yield a fault if the odometry reports motion while the robot stands."""
    is_resting = (np.abs(steps.true[:, :2]).max(axis=1) < MAX_REST_M) & (np.abs(steps.true[:, 2]) < MAX_REST_RAD)
    # While an obstacle blocks a robot that is commanded to drive, its wheels spin. This is slip, not drift.
    is_resting &= np.abs(steps.commanded).max(axis=1) < MAX_REST_M
    if int(is_resting.sum()) < MIN_REST_STEPS:
        return
    linear, _, angular = (np.median(steps.measured[is_resting], axis=0) / STEP_S).tolist()
    values: dict[str, object] = {}
    values |= {"linear": f"{linear:.3f} m/s"} if abs(linear) > MIN_DRIFT_M_S else {}
    values |= {"angular": f"{angular:.3f} rad/s"} if abs(angular) > MIN_DRIFT_RAD_S else {}
    if values:
        times = steps.times[is_resting]
        reason = Reason("the odometry moves while the robot stands", float(times[0]), float(times[-1]))
        yield FoundFault("odom", "drift", values, reason=reason)


def _noise_fault(
    steps: MotionSteps, predicted_distances: Array, predicted_turns: Array, drive_times: tuple[float, float]
) -> Iterator[FoundFault]:
    """Yield a fault if the measured distances and turns scatter about the predicted distances and turns (n,).

    `drive_times` are the start and the end of the drive in s.
    """
    values: dict[str, object] = {}
    distances, turns = steps.true[:, 0], steps.true[:, 2]
    is_moving, is_turning = np.abs(distances) > 0.05, np.abs(turns) > 0.05
    if is_moving.sum() >= 8:
        errors = (steps.measured[:, 0] - predicted_distances)[is_moving]
        linear = float(np.std(errors / np.sqrt(np.abs(distances[is_moving]))))
        values |= {"linear": f"{100 * linear:.1f} cm"} if linear > MIN_NOISE_M else {}
    if is_turning.sum() >= 8:
        errors = (steps.measured[:, 2] - predicted_turns)[is_turning]
        angular = float(np.std(errors / np.sqrt(np.abs(turns[is_turning]))))
        values |= {"angular": f"{math.degrees(angular):.1f} deg"} if angular > MIN_TURN_NOISE_RAD else {}
    if values:
        text = "the steps of the odometry scatter about the true motion"
        yield FoundFault("odom", "noise", values, reason=Reason(text, *drive_times, "low"))


BIN_S, MIN_BINS = 0.5, 8
"""Length of the time bins over which turn rates are averaged, and minimum number of bins for an estimate."""
MIN_BIAS_RAD_S, MIN_DRIFT_CHANGE_RAD_S = 0.006, 0.006
"""Minimum reported bias, and minimum change of the bias by a reported drift."""
MIN_GYRO_SCALE_ERROR, MIN_GYRO_TURN_RAD = 0.03, 2.0
"""Minimum deviation of a reported scale from 1, and minimum total turn for estimating the scale."""
MAX_RATE_CHANGE_RAD_S = 0.2
"""Maximum change of the turn rate between bins that are used for estimating a bias or a drift."""
MIN_RAMP_S, MIN_RAMP_SIGMAS = 4.0, 4.0
"""Minimum duration of a drift, and minimum change of the bias by a drift, as a multiple of the standard deviation of
the remaining errors."""
MAX_ERROR_RATIO = 0.2
"""Maximum ratio of the sums of squared errors with and without a drift or a scale that is reported."""


def gyroscope_faults(drive: RecordedDrive) -> Iterator[FoundFault]:
    """Yield at most one fault of the gyroscope: a wrong scale, a drift, or a bias."""
    times, measured, true = _turn_rates(drive)
    if len(times) < MIN_BINS:
        return
    total_turn = float(np.abs(true).sum() * BIN_S)
    scale = float(true @ measured) / max(float(true @ true), 1e-9) if total_turn > MIN_GYRO_TURN_RAD else 1.0
    scale_error_sum, error_sum = (float(np.sum((measured - factor * true) ** 2)) for factor in (scale, 1.0))
    if abs(scale - 1.0) > MIN_GYRO_SCALE_ERROR and scale_error_sum < MAX_ERROR_RATIO * error_sum:
        text = f"the gyroscope reports {100 * scale:.1f} % of the turns"
        yield FoundFault("imu", "scale", {"factor": f"{100 * scale:.1f} %"}, reason=Reason(text, float(times[0])))
        return
    changes = np.abs(np.diff(true, prepend=true[0], append=true[-1]))
    is_steady = np.maximum(changes[1:], changes[:-1]) < MAX_RATE_CHANGE_RAD_S
    times, errors = times[is_steady], (measured - true)[is_steady]
    if len(times) < MIN_BINS:
        return
    bias = float(np.median(errors))
    begin, end, slope, ramp_error_sum = _fit_ramp(times, errors)
    constant_error_sum = float(np.sum((errors - errors.mean()) ** 2))
    std = math.sqrt(ramp_error_sum / max(1, len(times) - 4))
    change = abs(slope) * (end - begin)
    is_large = change > max(MIN_DRIFT_CHANGE_RAD_S, MIN_RAMP_SIGMAS * std)
    if is_large and ramp_error_sum < MAX_ERROR_RATIO * constant_error_sum:
        text = f"the bias of the gyroscope grows by {slope:.5f} rad/s per second"
        is_from_start, is_until_end = begin <= float(times[0]) + BIN_S, end >= float(times[-1]) - BIN_S
        values = {"gyro": f"{slope:.5f} rad/s^2"}
        reason = Reason(text, begin, end, "medium")
        duration = None if is_until_end else end - begin
        yield FoundFault("imu", "drift", values, None if is_from_start else begin, duration, reason)
    elif abs(bias) > MIN_BIAS_RAD_S:
        text = f"the gyroscope reports {bias:.4f} rad/s at rest"
        yield FoundFault("imu", "bias", {"gyro": f"{bias:.4f} rad/s"}, reason=Reason(text, float(times[0])))


def _turn_rates(drive: RecordedDrive) -> tuple[Array, Array, Array]:
    """Return the start times (n,) of bins in s, and the mean turn rates (n,) in rad/s of gyroscope and true poses.

    Bins without a reading of the gyroscope or without known poses are omitted.
    """
    imu = drive.turn_rates
    if len(imu) < 2 or len(drive.poses) < 2 or imu.times[-1] - imu.times[0] <= BIN_S:
        return np.empty(0), np.empty(0), np.empty(0)
    edges = np.arange(float(imu.times[0]), float(imu.times[-1]), BIN_S)
    bin_indices = np.searchsorted(edges, imu.times, side="right") - 1
    is_in_bin = (bin_indices >= 0) & (bin_indices < len(edges) - 1)
    counts = np.bincount(bin_indices[is_in_bin], minlength=len(edges) - 1)
    totals = np.bincount(bin_indices[is_in_bin], imu.values[is_in_bin, 0], minlength=len(edges) - 1)
    yaws = np.unwrap(drive.poses.poses_at(edges)[:, 2])
    is_known = pose_is_known(drive, edges)
    is_kept = (counts > 0) & is_known[:-1] & is_known[1:]
    return edges[:-1][is_kept], totals[is_kept] / counts[is_kept], (np.diff(yaws) / BIN_S)[is_kept]


def _fit_ramp(times: Array, errors: Array) -> tuple[float, float, float, float]:
    """Fit a constant and a ramp, which lasts for a part of the time, to `errors` (n,) in rad/s.

    Return start and end of the ramp in s, its slope in rad/s², and the sum of squared errors.
    """
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
            error_sum = float(np.sum((errors - matrix @ solution) ** 2))
            if error_sum < best[3]:
                best = (float(times[first]), float(times[last - 1]) + BIN_S, float(solution[0]), error_sum)
    return best
