"""Finds outages, lost messages, delays, and low rates in the messages of a sensor, and repeated scans of a lidar.

In all functions, `target` is the name of the sensor, `end` is the end of the drive in s, and `gaps` are the times at
which the recorder lost all messages. The period is the usual time between messages in s.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.gaps import Gaps, seconds_in_gaps
from simscen.reconstruction.drive.recorded_drive import Mask, Scans, usual_period
from simscen.reconstruction.reasons import FoundFault, Reason, find_windows

MIN_OUTAGE_PERIODS = 4.5
"""Minimum time between two messages that is an outage, in periods."""
MIN_GAP_PERIODS = 1.5
"""Minimum time between two messages that is a gap with lost messages, in periods."""
MIN_LOST_FRACTION, MIN_LOST_MESSAGES = 0.03, 4
"""Minimum fraction, and minimum number, of lost messages that are reported."""
MAX_MULTIPLE_ERROR, MIN_MULTIPLE_FRACTION = 0.2, 0.7
"""Maximum difference, in periods, between a gap with lost messages and a multiple of the period, and minimum fraction
of gaps that meet this limit."""
MIN_DELAY_PERIODS, MIN_DELAY_S = 0.3, 0.03
"""Minimum reported delay: the larger of a number of periods and a time."""
MIN_OUTAGES_INTERMITTENT = 3
"""Minimum number of outages that are reported as one intermittent fault."""
SLOW_FACTOR = 1.6
"""Minimum ratio of the time between messages of a slow sensor to the period."""
MAX_RELATIVE_SPREAD = 0.15
"""Maximum standard deviation of the times between regular messages, as a fraction of the mean."""
MIN_REPEATED_SCANS = 3
"""Minimum number of repeated scans in a row that are reported."""
MIN_EQUAL_BEAMS = 20
"""Minimum number of beams with a return in both of two equal scans."""


def stream_faults(target: str, times: Array, arrivals: Array, end: float, gaps: Gaps = ()) -> Iterator[FoundFault]:
    """Yield the faults of a sensor whose messages were measured at `times` (n,) and logged at `arrivals` (n,), in s."""
    if len(times) < 3:
        return
    period = usual_period(times)
    if period <= 0.0:
        return
    yield from _delay_faults(target, times, arrivals, period, end)
    yield from _rate_and_gap_faults(target, times, period, end, gaps)


def _rate_and_gap_faults(target: str, times: Array, period: float, end: float, gaps: Gaps) -> Iterator[FoundFault]:
    """Yield a low rate or, if the rate is normal, outages and lost messages."""
    edges = np.append(times, max(end, float(times[-1])))
    steps = np.diff(edges) - seconds_in_gaps(gaps, edges[:-1], edges[1:])
    steps[-1] = max(steps[-1], period)
    outages = np.flatnonzero(steps > MIN_OUTAGE_PERIODS * period)
    slow = _slow_fault(target, times, period, end)
    if slow is not None:
        yield slow
        return
    if len(outages) >= MIN_OUTAGES_INTERMITTENT:
        durations = steps[outages] - period
        begin, last = float(edges[outages[0]] + period), float(edges[outages[-1] + 1])
        down = float(durations.mean())
        up = max(period, (last - begin - float(durations.sum())) / max(1, len(outages) - 1))
        text = f"{len(outages)} outages of {down:.2f} s on average"
        reason = Reason(text, begin, last)
        is_whole_drive = begin < up * 3 and last > end - 3 * up
        values = {"up": f"{up:.2f} s", "down": f"{down:.2f} s"}
        start, length = (None, None) if is_whole_drive else (begin, last - begin)
        yield FoundFault(target, "intermittent", values, start, length, reason)
        return
    for index in outages.tolist():
        begin, length = float(edges[index]) + 0.5 * period, float(steps[index]) - period
        is_until_end = edges[index + 1] >= end - period
        reason = Reason(f"no message for {steps[index]:.2f} s", float(edges[index]), float(edges[index + 1]))
        yield FoundFault(target, "off", {}, begin, None if is_until_end else length, reason)
    is_gap = (steps > MIN_GAP_PERIODS * period) & (steps <= MIN_OUTAGE_PERIODS * period)
    lost_count = int(np.round(steps[is_gap] / period - 1.0).sum())
    expected_count = len(times) + lost_count
    periods = steps[is_gap] / period
    is_multiple = np.abs(periods - np.round(periods)) < MAX_MULTIPLE_ERROR
    lost_fraction = lost_count / expected_count
    if (
        lost_count >= MIN_LOST_MESSAGES
        and lost_fraction > MIN_LOST_FRACTION
        and is_multiple.mean() > MIN_MULTIPLE_FRACTION
    ):
        gaps_with_loss = np.flatnonzero(is_gap)
        begin, last = float(edges[gaps_with_loss[0]]), float(edges[gaps_with_loss[-1] + 1])
        received_count = int(((times >= begin) & (times <= last)).sum())
        is_whole_drive = last - begin > 0.7 * (end - float(times[0]))
        probability = lost_fraction if is_whole_drive else lost_count / (lost_count + received_count)
        reason = Reason(f"{lost_count} of {expected_count} messages are missing", begin, last)
        start, length = (None, None) if is_whole_drive else (begin, last - begin)
        yield FoundFault(target, "dropout", {"probability": f"{100 * probability:.0f} %"}, start, length, reason)


def _slow_fault(target: str, times: Array, period: float, end: float) -> FoundFault | None:
    """Return the fault of a sensor whose rate is regular but too low for some time; None without this fault."""
    steps = np.diff(times)
    is_slow = steps > SLOW_FACTOR * period
    if not is_slow.all() and not _is_regular(steps[~is_slow]):
        return None
    for window in find_windows(is_slow, times[1:], max_gap=1.2 * period):
        slow_steps = steps[window.samples]
        if len(slow_steps) < 4 or not _is_regular(slow_steps):
            continue
        step = float(np.median(slow_steps))
        begin = float(times[window.first])
        is_whole_drive = window.length > 0.8 * (end - float(times[0]))
        reason = Reason(f"{1 / step:.2f} messages per second instead of {1 / period:.2f}", begin, window.end)
        start, length = (None, None) if is_whole_drive else (begin, window.end - begin)
        return FoundFault(target, "slow", {"rate": f"{1 / step:.2f} Hz"}, start, length, reason)
    return None


def _is_regular(steps: Array) -> bool:
    """Return whether the times between messages, `steps` (n,), are nearly equal."""
    return float(np.std(steps)) <= MAX_RELATIVE_SPREAD * float(np.mean(steps))


def _delay_faults(target: str, times: Array, arrivals: Array, period: float, end: float) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which messages were logged late."""
    delays = arrivals - times
    normal_delay = max(0.0, float(np.percentile(delays, 2)))
    is_late = delays > max(MIN_DELAY_S, MIN_DELAY_PERIODS * period)
    for window in find_windows(is_late, times, max_gap=4 * period):
        late_delays = delays[window.samples]
        if len(late_delays) < 3:
            continue
        low, high = float(np.percentile(late_delays, 3)), float(np.percentile(late_delays, 97))
        is_whole_drive = window.first <= 2 and window.end > end - 4 * period - high
        latency = low if is_whole_drive else low - normal_delay
        values = {"latency": f"{1000 * max(0.0, latency):.0f} ms"}
        if high - low > 0.25 * period:
            values["jitter"] = f"{1000 * (high - low):.0f} ms"
        reason = Reason(f"messages arrive {low:.3f} to {high:.3f} s late", window.begin, window.end)
        start, length = (None, None) if is_whole_drive else (window.begin, window.length)
        yield FoundFault(target, "delay", values, start, length, reason)


def repeated_scans(scans: Scans) -> Mask:
    """Return a mask (n,) of scans that repeat the previous scan.

    In both scans, at least MIN_EQUAL_BEAMS beams have a return, and the ranges of all these beams are equal.
    """
    is_repeated = np.zeros(len(scans), dtype=bool)
    if len(scans) < 2:
        return is_repeated
    current, previous = scans.ranges[1:], scans.ranges[:-1]
    is_finite = np.isfinite(current) & np.isfinite(previous)
    is_equal = (current == previous) | ~is_finite
    is_repeated[1:] = is_equal.all(axis=1) & (is_finite.sum(axis=1) >= MIN_EQUAL_BEAMS)
    return is_repeated


def stuck_scans(scans: Scans, end: float) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which a lidar repeated its last scan."""
    for window in find_windows(repeated_scans(scans), scans.times, max_gap=0.5 * scans.period):
        if window.last - window.first + 1 < MIN_REPEATED_SCANS:
            continue
        begin = max(0.0, window.begin - 1.5 * scans.period)
        is_until_end = window.end >= end - 1.5 * scans.period
        length = window.end - begin + 0.5 * scans.period
        reason = Reason("the same scan is repeated", window.begin, window.end)
        yield FoundFault("lidar", "stuck", {}, begin, None if is_until_end else length, reason)
