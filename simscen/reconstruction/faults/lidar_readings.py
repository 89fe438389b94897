"""Finds lidar faults from the ranges in the scans: invalid scans, missing beams, a limited range, rain, and noise.

In all functions, `end` is the end of the drive in s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.ndimage import median_filter

from simscen.core.geometry import Array
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.drive.recorded_drive import Mask
from simscen.reconstruction.reasons import FoundFault, Reason, Window, find_windows

MIN_EXTRA_NOISE_M, EXTRA_NOISE_FACTOR = 0.012, 0.8
"""Noise of a lidar with only typical values is reported if it exceeds the nominal noise by the larger of a distance and
a multiple of the nominal noise. Rain is reported if the noise exceeds the nominal noise by the distance."""
KNOWN_NOISE_FACTOR, MIN_KNOWN_EXTRA_NOISE_M = 1.2, 0.002
"""Noise of a lidar with known noise is reported if it exceeds the larger of a multiple of the known noise, and the
known noise plus a distance."""
MIN_NOISE_S = 2.0
"""Minimum duration of reported noise."""
MIN_INVALID_SCANS = 2
"""Minimum number of invalid scans that are reported."""
MIN_NAN_FRACTION = 0.03
"""Minimum fraction of nan ranges in a scan with missing beams."""
BLIND_FRACTION = 0.95
"""Minimum fraction of scans in which a blind beam returns nan. If as many beams are blind, they are no sector."""
MIN_SECTOR_BEAMS = 3
"""Minimum number of neighboring beams of a sector."""
MIN_MISSING_FRACTION, MAX_NEAR_FRACTION = 0.03, 0.1
"""For a limited range: minimum fraction of beams without a return although the static world is in range, and maximum
fraction of these beams with an expected range below the limit."""
MIN_WINDOW_S, MAX_WINDOW_GAP_S = 0.4, 0.6
"""Minimum duration of a fault, and maximum interruption within a fault."""
RAIN_ALPHA, RAIN_EXPONENT, RAIN_NOISE_PER_M = 0.01, 0.6, 0.02
"""Model of the fault `rain` (Goodin et al., 2019) for the rain rate R in mm/h and the range z in m: extinction
α = 0.01 R^0.6 per meter, noise 0.02 z (1 - e^-R)² m."""
WHITE_REFLECTIVITY = 0.9
"""Reflectivity of a surface that the lidar detects up to its maximum range in clear air, as in the fault `rain`."""
HEAVY_RAIN_MM_H = 25.0
"""Maximum reported rain rate."""


def invalid_scan_faults(compared: ComparedScans, end: float) -> Iterator[FoundFault]:
    """Yield at most one fault, which covers all invalid scans."""
    invalid, times = compared.is_invalid, compared.scans.times
    if int(invalid.sum()) < MIN_INVALID_SCANS:
        return
    indices = np.flatnonzero(invalid)
    first, last = int(indices[0]), int(indices[-1])
    share = float(invalid[first : last + 1].mean())
    whole = times[last] - times[first] > 0.6 * end
    share = float(invalid.mean()) if whole else share
    values: dict[str, object] = {}
    kinds = {_garbage_value(compared, index) for index in indices.tolist()}
    if len(kinds) == 1:
        values["value"] = kinds.pop()
    if share < 0.9:
        values["probability"] = f"{100 * share:.0f} %"
    begin, length = float(times[first]), float(times[last] - times[first]) + compared.scans.period
    reason = Reason(f"{len(indices)} scans have no valid ranges", begin, float(times[last]))
    yield FoundFault("lidar", "garbage", values, None if whole else begin, None if whole else length, reason)


def _garbage_value(compared: ComparedScans, index: int) -> str:
    """Return the parameter `value` of the fault `garbage` for the invalid scan `index`, such as "nan" or "short"."""
    ranges = compared.scans.ranges[index]
    if compared.scans.is_malformed[index]:
        return "short"
    if np.isnan(ranges).all():
        return "nan"
    if (ranges == np.inf).mean() > 0.9:
        return "inf"
    if (ranges < 0).all():
        return "negative"
    return "zero" if (ranges == 0).all() else "huge"


def missing_beam_faults(compared: ComparedScans, end: float) -> Iterator[FoundFault]:
    """Yield faults of beams that return nan: blind sectors, and beams that are lost at random."""
    usable = ~compared.is_invalid
    missing = np.isnan(compared.scans.ranges)
    blind = np.zeros(missing.shape[1], dtype=bool)
    for window in usable_windows(missing.mean(axis=1) > MIN_NAN_FRACTION, compared):
        chosen = missing[window.samples][usable[window.samples]]
        always = chosen.mean(axis=0) > BLIND_FRACTION
        if always.mean() < BLIND_FRACTION and (
            runs := [run for run in mask_runs(always) if run[1] - run[0] + 1 >= MIN_SECTOR_BEAMS]
        ):
            for first, last in runs:
                blind[first : last + 1] = True
                begin, stop = sector_limits_text(compared.scans.angles, first, last)
                values = {"from": f"{begin} deg", "to": f"{stop} deg"}
                text = f"the beams from {begin} to {stop} deg return nothing"
                yield lidar_fault_in_window("sector", values, window, compared, end, text)
        others = chosen[:, ~blind]
        share = float(others.mean()) if others.size else 0.0
        if share > MIN_NAN_FRACTION:
            text = f"{100 * share:.0f} % of the beams return nothing"
            yield lidar_fault_in_window(
                "beam_dropout", {"probability": f"{100 * share:.0f} %"}, window, compared, end, text
            )


def sector_limits_text(angles: Array, first: int, last: int) -> tuple[str, str]:
    """Return the directions of two beams as text in degrees, with enough digits to tell neighbor beams apart."""
    spacing = float(np.degrees(abs(angles[1] - angles[0])))
    decimals = max(0, math.ceil(-math.log10(spacing)))
    begin, end = (f"{math.degrees(angles[index]):.{decimals}f}" for index in (first, last))
    return begin, end


def mask_runs(mask: Mask) -> list[tuple[int, int]]:
    """Return the first and last index of each run of true values in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def range_faults(compared: ComparedScans, end: float, nominal_noise: float) -> Iterator[FoundFault]:
    """Yield faults for far objects without a return: rain or a range limit.

    It is rain if the noise exceeds `nominal_noise`, a standard deviation in m, by MIN_EXTRA_NOISE_M.
    """
    usable = ~compared.is_invalid
    near = np.isfinite(compared.expected) & (compared.expected < 0.97 * compared.scans.range_max)
    lost = compared.is_missing & near
    for window in usable_windows(lost.mean(axis=1) > MIN_MISSING_FRACTION, compared):
        rows = np.zeros(len(usable), dtype=bool)
        rows[window.samples] = usable[window.samples]
        hits = compared.scans.ranges[rows][compared.is_hit[rows]]
        if not len(hits):
            continue
        limit = float(np.percentile(hits, 99.8))
        beyond = near[rows] & (compared.expected[rows] > limit + 0.3)
        before = lost[rows] & (compared.expected[rows] < limit - 0.3)
        if before.sum() > MAX_NEAR_FRACTION * max(1, lost[rows].sum()) or not beyond.any():
            continue
        if lost[rows][beyond].mean() < 0.8:
            continue
        noise = float(np.median(compared.noise[rows]))
        if noise > nominal_noise + MIN_EXTRA_NOISE_M:
            mean_range = float(np.median(hits))
            values = rain_values(limit, noise / mean_range, compared.scans.range_max)
            text = f"nothing beyond {limit:.1f} m returns, and ranges have {100 * noise:.1f} cm of noise"
            yield lidar_fault_in_window("rain", values, window, compared, end, text)
        else:
            text = f"nothing beyond {limit:.1f} m returns"
            yield lidar_fault_in_window("range_limit", {"max": f"{limit:.2f} m"}, window, compared, end, text)


def rain_values(limit: float, noise_per_meter: float, range_max: float) -> dict[str, object]:
    """Return the parameters of the fault `rain` with which the lidar sees objects up to `limit` m.

    `noise_per_meter` is the standard deviation per meter of range, `range_max` the maximum range in m in clear air.
    """
    share = math.sqrt(min(1.0, noise_per_meter / RAIN_NOISE_PER_M))
    rate = HEAVY_RAIN_MM_H if share > 0.99 else min(HEAVY_RAIN_MM_H, -math.log(1.0 - share))
    alpha = RAIN_ALPHA * rate**RAIN_EXPONENT
    reflectivity = WHITE_REFLECTIVITY * (limit / range_max) ** 2 * math.exp(2 * alpha * limit)
    return {"rate": f"{rate:.1f} mm/h", "reflectivity": f"{100 * min(1.0, max(0.02, reflectivity)):.0f} %"}


def noise_faults(compared: ComparedScans, end: float, nominal_noise: float, is_known: bool) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which ranges have more noise than `nominal_noise` m.

    `is_known` states that `nominal_noise` is the noise of this lidar instead of a typical value.
    """
    noise = median_filter(compared.noise, size=5, mode="nearest")
    limit = nominal_noise + max(MIN_EXTRA_NOISE_M, EXTRA_NOISE_FACTOR * nominal_noise)
    if is_known:
        limit = max(KNOWN_NOISE_FACTOR * nominal_noise, nominal_noise + MIN_KNOWN_EXTRA_NOISE_M)
    for window in usable_windows(noise > limit, compared):
        if window.length < MIN_NOISE_S:
            continue
        measured = float(np.sqrt(np.mean(noise[window.samples] ** 2)))
        extra = math.sqrt(max(0.0, measured**2 - nominal_noise**2))
        text = f"ranges have {100 * measured:.1f} cm of noise"
        yield lidar_fault_in_window("noise", {"std": f"{100 * extra:.1f} cm"}, window, compared, end, text)


def usable_windows(mask: Mask, compared: ComparedScans) -> list[Window]:
    """Return the time windows in which `mask` (n,) is true. An invalid scan has the value of the last valid scan."""
    usable = ~compared.is_invalid
    newest = np.maximum.accumulate(np.where(usable, np.arange(len(mask)), 0))
    return find_windows(mask[newest] & usable[newest], compared.scans.times, MIN_WINDOW_S, MAX_WINDOW_GAP_S)


def lidar_fault_in_window(
    kind: str, values: Mapping[str, object], window: Window, compared: ComparedScans, end: float, text: str
) -> FoundFault:
    """Return a lidar fault with the reason `text`.

    The start is None if the window begins with the drive. The duration is None if the window ends with the drive.
    """
    times, period = compared.scans.times, compared.scans.period
    from_start = window.begin <= float(times[0]) + 3 * period
    until_end = window.end >= min(end, float(times[-1])) - 5 * period
    begin = None if from_start else max(0.0, window.begin - 0.5 * period)
    duration = None if until_end else window.end - (begin or 0.0) + 0.5 * period
    confidence = "high" if window.last - window.first >= 10 else "medium"
    return FoundFault("lidar", kind, values, begin, duration, Reason(text, window.begin, window.end, confidence))
