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
"""Minimum difference between reported noise and nominal noise if the noise of this lidar is not known: the larger of a
distance and a multiple of the nominal noise. For rain, the minimum difference is the distance."""
MIN_KNOWN_EXTRA_NOISE_M, KNOWN_NOISE_FACTOR = 0.002, 1.2
"""Limits of reported noise if the noise of this lidar is known: minimum difference from the known noise, and minimum
ratio to the known noise."""
MIN_NOISE_S = 2.0
"""Minimum duration of reported noise."""
MIN_INVALID_SCANS = 2
"""Minimum number of invalid scans that are reported."""
MIN_NAN_FRACTION = 0.03
"""Minimum fraction of nan ranges in a scan with missing beams."""
MIN_BLIND_FRACTION = 0.95
"""Minimum fraction of scans in which a blind beam has the range nan. If this fraction of all beams is blind, the beams
are not a sector."""
MIN_SECTOR_BEAMS = 3
"""Minimum number of neighboring beams of a sector."""
MIN_LOST_FRACTION, MAX_NEAR_FRACTION = 0.03, 0.1
"""For a limited range: minimum fraction of lost beams, which have no return although the static world is in range, and
maximum fraction of lost beams whose expected range is below the limit."""
MIN_LOST_BEYOND_FRACTION = 0.8
"""For a limited range: minimum fraction of lost beams among beams whose expected range is above the limit."""
LIMIT_MARGIN_M = 0.3
"""For a limited range: minimum difference between the limit and an expected range below or above the limit."""
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
    is_invalid, times = compared.is_invalid, compared.scans.times
    if int(is_invalid.sum()) < MIN_INVALID_SCANS:
        return
    indices = np.flatnonzero(is_invalid)
    first, last = int(indices[0]), int(indices[-1])
    is_whole_drive = times[last] - times[first] > 0.6 * end
    fraction = float(is_invalid.mean() if is_whole_drive else is_invalid[first : last + 1].mean())
    values: dict[str, object] = {}
    garbage_values = {_garbage_value(compared, index) for index in indices.tolist()}
    if len(garbage_values) == 1:
        values["value"] = garbage_values.pop()
    if fraction < 0.9:
        values["probability"] = f"{100 * fraction:.0f} %"
    begin, length = float(times[first]), float(times[last] - times[first]) + compared.scans.period
    reason = Reason(f"{len(indices)} scans have no valid ranges", begin, float(times[last]))
    start, duration = (None, None) if is_whole_drive else (begin, length)
    yield FoundFault("lidar", "garbage", values, start, duration, reason)


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
    """Yield faults of beams with the range nan: blind sectors, and beams that are lost at random."""
    is_usable = ~compared.is_invalid
    is_nan = np.isnan(compared.scans.ranges)
    is_in_sector = np.zeros(is_nan.shape[1], dtype=bool)
    for window in usable_windows(is_nan.mean(axis=1) > MIN_NAN_FRACTION, compared):
        is_nan_in_window = is_nan[window.samples][is_usable[window.samples]]
        is_blind = is_nan_in_window.mean(axis=0) > MIN_BLIND_FRACTION
        if is_blind.mean() < MIN_BLIND_FRACTION:
            for first, last in mask_runs(is_blind):
                if last - first + 1 < MIN_SECTOR_BEAMS:
                    continue
                is_in_sector[first : last + 1] = True
                start, stop = sector_limits_text(compared.scans.angles, first, last)
                values = {"from": f"{start} deg", "to": f"{stop} deg"}
                text = f"the beams from {start} to {stop} deg return nothing"
                yield lidar_fault_in_window("sector", values, window, compared, end, text)
        is_nan_outside = is_nan_in_window[:, ~is_in_sector]
        fraction = float(is_nan_outside.mean()) if is_nan_outside.size else 0.0
        if fraction > MIN_NAN_FRACTION:
            values = {"probability": f"{100 * fraction:.0f} %"}
            text = f"{100 * fraction:.0f} % of the beams return nothing"
            yield lidar_fault_in_window("beam_dropout", values, window, compared, end, text)


def sector_limits_text(angles: Array, first: int, last: int) -> tuple[str, str]:
    """Return the directions of the beams `first` and `last` in degrees as text.

    The texts have enough digits to tell neighbor beams apart.
    """
    spacing = float(np.degrees(abs(angles[1] - angles[0])))
    decimals = max(0, math.ceil(-math.log10(spacing)))
    first_text, last_text = (f"{math.degrees(angles[index]):.{decimals}f}" for index in (first, last))
    return first_text, last_text


def mask_runs(mask: Mask) -> list[tuple[int, int]]:
    """Return the first and last index of each run of true values in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def range_faults(compared: ComparedScans, end: float, nominal_noise: float) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which far objects have no return: rain or a range limit.

    The fault is rain if the noise exceeds `nominal_noise`, a standard deviation in m, by MIN_EXTRA_NOISE_M.
    """
    is_usable = ~compared.is_invalid
    is_in_range = np.isfinite(compared.expected) & (compared.expected < 0.97 * compared.scans.range_max)
    is_lost = compared.is_missing & is_in_range
    for window in usable_windows(is_lost.mean(axis=1) > MIN_LOST_FRACTION, compared):
        rows = np.zeros(len(is_usable), dtype=bool)
        rows[window.samples] = is_usable[window.samples]
        hits = compared.scans.ranges[rows][compared.is_hit[rows]]
        if not len(hits):
            continue
        limit = float(np.percentile(hits, 99.8))
        is_beyond_limit = is_in_range[rows] & (compared.expected[rows] > limit + LIMIT_MARGIN_M)
        is_lost_before_limit = is_lost[rows] & (compared.expected[rows] < limit - LIMIT_MARGIN_M)
        if is_lost_before_limit.sum() > MAX_NEAR_FRACTION * max(1, is_lost[rows].sum()) or not is_beyond_limit.any():
            continue
        if is_lost[rows][is_beyond_limit].mean() < MIN_LOST_BEYOND_FRACTION:
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

    `noise_per_meter` is the standard deviation per meter of range. `range_max` is the maximum range in m in clear air.
    """
    saturation = math.sqrt(min(1.0, noise_per_meter / RAIN_NOISE_PER_M))  # 1 - e^-R in the model
    rate = HEAVY_RAIN_MM_H if saturation > 0.99 else min(HEAVY_RAIN_MM_H, -math.log(1.0 - saturation))
    alpha = RAIN_ALPHA * rate**RAIN_EXPONENT
    reflectivity = WHITE_REFLECTIVITY * (limit / range_max) ** 2 * math.exp(2 * alpha * limit)
    return {"rate": f"{rate:.1f} mm/h", "reflectivity": f"{100 * min(1.0, max(0.02, reflectivity)):.0f} %"}


def noise_faults(compared: ComparedScans, end: float, nominal_noise: float, is_known: bool) -> Iterator[FoundFault]:
    """Yield a fault for each time window in which ranges have more noise than `nominal_noise`.

    `nominal_noise` is a standard deviation in m. `is_known` states that it is the noise of this lidar. Otherwise, it is
    the noise of a typical lidar, and only larger differences are reported.
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
    """Return the time windows in which `mask` (n,) is true. An invalid scan counts like the last valid scan."""
    is_usable = ~compared.is_invalid
    last_usable = np.maximum.accumulate(np.where(is_usable, np.arange(len(mask)), 0))
    return find_windows(
        mask[last_usable] & is_usable[last_usable], compared.scans.times, MIN_WINDOW_S, MAX_WINDOW_GAP_S
    )


def lidar_fault_in_window(
    kind: str, values: Mapping[str, object], window: Window, compared: ComparedScans, end: float, text: str
) -> FoundFault:
    """Return a lidar fault in a time window. `kind` is the YAML key of the fault, and `text` the reason.

    The start is None if the window begins with the drive. The duration is None if the window ends with the drive.
    """
    times, period = compared.scans.times, compared.scans.period
    is_from_start = window.begin <= float(times[0]) + 3 * period
    is_until_end = window.end >= min(end, float(times[-1])) - 5 * period
    begin = None if is_from_start else max(0.0, window.begin - 0.5 * period)
    duration = None if is_until_end else window.end - (begin or 0.0) + 0.5 * period
    confidence = "high" if window.last - window.first >= 10 else "medium"
    return FoundFault("lidar", kind, values, begin, duration, Reason(text, window.begin, window.end, confidence))
