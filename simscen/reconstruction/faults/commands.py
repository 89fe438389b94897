"""Finds faults of the velocity commands and of the base: late or ignored commands, wrong gains, and speed limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.ndimage import uniform_filter1d

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive
from simscen.reconstruction.reasons import FoundFault, Reason, find_windows

SAMPLE_PERIOD_S = 0.025
"""Period of the samples at which commands and odometry are compared."""
MIN_SAMPLES = 80
"""Minimum number of samples of a drive for finding faults."""
MAX_LAG_S, MIN_LAG_S = 1.0, 0.16
"""Maximum lag that is searched for, and minimum lag that is reported."""
NORMAL_LAG_S = 0.09
"""Lag of a base without faults, which is subtracted from the reported latency."""
MIN_COMMAND_M_S = 0.1
"""Speed above which a command, or the base, counts as driving."""
MAX_IGNORED_RATIO, MIN_IGNORED_S = 0.1, 0.4
"""Maximum ratio of driven to commanded speed, and minimum duration, of an ignored command."""
MAX_KEPT_RATIO, MIN_KEPT_S = 0.5, 0.6
"""Maximum ratio of commanded to driven speed, and minimum duration, of a base that keeps its speed."""
STEADY_S, MAX_STEADY_CHANGE = 0.4, 0.05
"""Minimum duration of a steady command, and maximum change in this time as a fraction of the command."""
MIN_GAIN_ERROR = 0.08
"""Minimum deviation of a reported gain (ratio of driven to commanded speed) from 1."""
MIN_STEADY_SAMPLES = 20
"""Minimum number of samples with a steady command for estimating a speed limit or a gain."""
MIN_SIDE_DIFFERENCE, MAX_UNEXPLAINED_FRACTION = 0.1, 0.05
"""Minimum difference between reported gains of left and right wheels, and maximum fraction of the squared speed that
these gains do not explain."""
MIN_SHORTFALL_M_S, MAX_LIMIT_SPREAD_M_S = 0.04, 0.03
"""Minimum difference between commanded and driven speed at a speed limit, and maximum standard deviation of the driven
speed at a speed limit."""
MIN_SHORTFALL_FRACTION = 0.2
"""Minimum fraction of the samples in which the speed is below the command for reporting a speed limit or a gain."""
SMOOTHING_S = 0.5
"""Time over which speeds are averaged."""
MIN_LIMIT_FALL_M_S = 0.05
"""Minimum decrease of the speed limit during the drive that is reported as a low battery."""
MIN_ERROR_DECREASE = 0.02
"""Minimum decrease of the mean squared difference between command and motion for finding a lag, as a fraction of the
variance of the command."""
MIN_COMMAND_STD = 0.05
"""Minimum standard deviation of a commanded velocity, in m/s or rad/s, for estimating the lag."""


def command_faults(drive: RecordedDrive, wheel_separation: float = 0.0) -> Iterator[FoundFault]:
    """Yield the faults of the commands and of the base.

    `wheel_separation` is the distance in m between left and right wheels; 0 to omit faults of one side.
    """
    times, commanded, driven = _velocities(drive)
    if len(times) < MIN_SAMPLES:
        return
    lag = _lag(commanded, driven)
    if lag >= MIN_LAG_S:
        text = f"the base follows its commands {lag:.2f} s late"
        values = {"latency": f"{1000 * (lag - NORMAL_LAG_S):.0f} ms"}
        yield FoundFault("cmd_vel", "delay", values, reason=Reason(text, float(times[0]), float(times[-1]), "medium"))
    shift = round(lag / SAMPLE_PERIOD_S)
    if shift:
        commanded, driven, times = commanded[:-shift], driven[shift:], times[shift:]
    ignored = [*_ignored_commands(times, commanded, driven), *_kept_speeds(times, commanded, driven)]
    yield from ignored
    if ignored:
        return
    sides = [*_side_gains(times, commanded, driven, wheel_separation)]
    yield from sides
    if not sides:
        yield from _limit_or_gain(times, commanded, driven)


def _velocities(drive: RecordedDrive) -> tuple[Array, Array, Array]:
    """Return times (n,), commanded velocities vx, wz (n, 2), and driven velocities vx, wz (n, 2)."""
    commands, odometry = drive.commands, drive.odometry
    if len(commands) < 2 or len(odometry) < 2:
        return np.empty(0), np.empty((0, 2)), np.empty((0, 2))
    begin = max(float(commands.times[0]), float(odometry.times[0]))
    times = np.arange(begin, min(float(commands.times[-1]), float(odometry.times[-1])), SAMPLE_PERIOD_S)
    # Commands have no stamp in many logs, so their log time counts.
    command = commands.values[np.maximum(np.searchsorted(commands.arrivals, times, side="right") - 1, 0)]
    return times, command[:, [0, 2]], odometry.values_at(times)[:, [3, 5]]


def _moving_average(speeds: Array) -> Array:
    """Return the average of `speeds` (n,) over SMOOTHING_S at each sample."""
    return uniform_filter1d(speeds, round(SMOOTHING_S / SAMPLE_PERIOD_S), mode="nearest")


def _lag(commanded: Array, driven: Array) -> float:
    """Return the lag in s of the driven velocities (n, 2) behind the commanded velocities (n, 2); 0 without a lag."""
    is_varying = np.std(commanded, axis=0) >= MIN_COMMAND_STD
    if not is_varying.any():
        return 0.0
    commanded, driven = commanded[:, is_varying], driven[:, is_varying]
    scale = np.std(commanded, axis=0)
    smallest_error, lag, error_without_lag = np.inf, 0, np.inf
    for shift in range(0, min(round(MAX_LAG_S / SAMPLE_PERIOD_S), len(commanded) // 4)):
        shifted_commands = commanded[: len(commanded) - shift] / scale
        error = float(np.mean((shifted_commands - driven[shift:] / scale) ** 2))
        error_without_lag = error if shift == 0 else error_without_lag
        if error < smallest_error - 1e-9:
            smallest_error, lag = error, shift
    return lag * SAMPLE_PERIOD_S if error_without_lag - smallest_error > MIN_ERROR_DECREASE else 0.0


def _ignored_commands(times: Array, commanded: Array, driven: Array) -> list[FoundFault]:
    """Return a fault for each time window in which the base stood although it was commanded to drive."""
    is_ignoring = (np.abs(commanded[:, 0]) > MIN_COMMAND_M_S) & (
        np.abs(driven[:, 0]) < MAX_IGNORED_RATIO * np.abs(commanded[:, 0])
    )
    faults = []
    for window in find_windows(is_ignoring, times, MIN_IGNORED_S, 0.1):
        reason = Reason("the base stands although it is commanded to drive", window.begin, window.end, "medium")
        faults.append(FoundFault("cmd_vel", "off", {}, max(0.0, window.begin - 0.5), window.length + 0.5, reason))
    return faults


def _kept_speeds(times: Array, commanded: Array, driven: Array) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which the base kept its speed although it was commanded to slow down."""
    speed = _moving_average(driven[:, 0])
    is_keeping = (np.abs(speed) > MIN_COMMAND_M_S) & (np.abs(commanded[:, 0]) < MAX_KEPT_RATIO * np.abs(speed))
    for window in find_windows(is_keeping, times, MIN_KEPT_S, 0.1):
        if float(np.std(speed[window.samples])) < MAX_LIMIT_SPREAD_M_S:
            text = "the base keeps its speed although it is commanded to stop"
            reason = Reason(text, window.begin, window.end, "medium")
            begin = max(0.0, window.begin - STEADY_S)
            yield FoundFault("cmd_vel", "stuck", {}, begin, window.end - begin, reason)


def _side_gains(times: Array, commanded: Array, driven: Array, wheel_separation: float) -> Iterator[FoundFault]:
    """Yield a fault if the left and the right wheels have different gains (ratio of driven to commanded speed)."""
    if wheel_separation <= 0.0:
        return
    gains, unexplained_fractions = [], []
    for lever_arm in (-wheel_separation / 2, wheel_separation / 2):
        command, speed = (_moving_average(motion[:, 0] + lever_arm * motion[:, 1]) for motion in (commanded, driven))
        gain = float(command @ speed) / max(float(command @ command), 1e-9)
        gains.append(gain)
        squared_error = float(np.mean((speed - gain * command) ** 2))
        unexplained_fractions.append(squared_error / max(float(np.mean(speed**2)), 1e-9))
    if abs(gains[0] - gains[1]) < MIN_SIDE_DIFFERENCE or max(unexplained_fractions) > MAX_UNEXPLAINED_FRACTION:
        return
    left, right = (f"{100 * gain:.0f} %" for gain in gains)
    text = f"the left wheels drive {left} and the right wheels {right} of their commands"
    reason = Reason(text, float(times[0]), float(times[-1]), "medium")
    yield FoundFault("wheels", "gain", {"left": left, "right": right}, reason=reason)


def _limit_or_gain(times: Array, commanded: Array, driven: Array) -> Iterator[FoundFault]:
    """Yield at most one fault: a falling speed limit, a constant speed limit, or a gain of the speed."""
    is_steady = _is_steady(commanded) & (np.abs(commanded[:, 0]) > MIN_COMMAND_M_S)
    if int(is_steady.sum()) < MIN_STEADY_SAMPLES:
        return
    command, speed = np.abs(commanded[is_steady, 0]), np.abs(_moving_average(driven[:, 0]))[is_steady]
    steady_times = times[is_steady]
    ratio = speed / command
    is_slow = command - speed > MIN_SHORTFALL_M_S
    if is_slow.mean() < MIN_SHORTFALL_FRACTION:
        return
    reason_times = float(steady_times[is_slow][0]), float(steady_times[is_slow][-1])
    start, end, drain, spread = _falling_limit(steady_times[is_slow], speed[is_slow])
    if start - end > MIN_LIMIT_FALL_M_S and spread < MAX_LIMIT_SPREAD_M_S:
        values = {"start": f"{start:.2f} m/s", "end": f"{max(end, 0.01):.2f} m/s", "drain": f"{drain:.0f} s"}
        text = f"the speed falls from {start:.2f} to {end:.2f} m/s although more is commanded"
        yield FoundFault("cmd_vel", "low_battery", values, reason=Reason(text, *reason_times, "medium"))
        return
    limit = float(np.median(speed[is_slow]))
    is_below_limit = (command < limit) & ~is_slow
    if float(np.std(speed[is_slow])) < MAX_LIMIT_SPREAD_M_S and (
        np.std(command[is_slow]) > MAX_LIMIT_SPREAD_M_S or is_below_limit.any()
    ):
        text = f"the robot drives at most {limit:.2f} m/s although more is commanded"
        values = {"linear": f"{limit:.2f} m/s"}
        yield FoundFault("cmd_vel", "saturation", values, reason=Reason(text, *reason_times, "medium"))
    elif abs(float(np.median(ratio)) - 1.0) > MIN_GAIN_ERROR:
        gain = float(np.median(ratio))
        text = f"the robot drives {100 * gain:.0f} % of the commanded speed"
        values = {"linear": f"{100 * gain:.0f} %"}
        yield FoundFault("cmd_vel", "gain", values, reason=Reason(text, *reason_times, "medium"))


def _falling_limit(times: Array, speeds: Array) -> tuple[float, float, float, float]:
    """Fit a speed limit, which first falls linearly and then is constant, to `speeds` (n,) at `times` (n,).

    Return the limit in m/s at time 0, the final limit in m/s, the time in s at which the fall ends, and the standard
    deviation of the speeds from the limit in m/s.
    """
    best = (0.0, 0.0, 0.0, math.inf)
    for drain in np.linspace(times[0], times[-1], 25)[4:].tolist():
        fractions = np.minimum(times, drain) / drain
        matrix = np.column_stack((1.0 - fractions, fractions))
        solution, *_ = np.linalg.lstsq(matrix, speeds, rcond=None)
        spread = float(np.std(speeds - matrix @ solution))
        if spread < best[3]:
            best = (float(solution[0]), float(solution[1]), drain, spread)
    return best


def _is_steady(commanded: Array) -> Mask:
    """Return a mask (n,) of samples at which the commanded speed has been steady for STEADY_S."""
    count = round(STEADY_S / SAMPLE_PERIOD_S)
    speed = np.abs(commanded[:, 0])
    is_steady = np.zeros(len(speed), dtype=bool)
    if len(speed) <= count:
        return is_steady
    windows = np.lib.stride_tricks.sliding_window_view(speed, count + 1)
    is_steady[count:] = np.ptp(windows, axis=1) <= MAX_STEADY_CHANGE * np.maximum(speed[count:], MIN_COMMAND_M_S)
    return is_steady
