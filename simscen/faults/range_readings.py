"""What faults do to distances: those of a lidar's beams and of a camera's pixels."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Image, Reading, Scan


def with_distances(reading: Reading, change: Callable[[Array], Array]) -> Reading:
    """The reading with other distances; beams and pixels without an answer, or without a hit, keep what they say.

    What a lidar measures beyond its range is no hit (inf), what it measures below gives no answer (nan).
    """
    match reading:
        case Scan(ranges=ranges):
            return replace(reading, ranges=clip_to_sensor_range(reading, _changed(ranges, change)))
        case Image(depth=depth):
            changed = _changed(depth.astype(np.float64), change)
            return replace(reading, depth=np.maximum(changed, 0.0).astype(np.float32))
        case _:
            return reading


def clip_to_sensor_range(scan: Scan, ranges: Array) -> Array:
    """Ranges as the lidar of a scan tells them."""
    with np.errstate(invalid="ignore"):
        ranges = np.where(ranges > scan.range_max, np.inf, ranges)
        return np.where(ranges < scan.range_min, np.nan, ranges)


def _changed(distances: Array, change: Callable[[Array], Array]) -> Array:
    return np.where(np.isfinite(distances), change(distances), distances)


def ranges_with_scan_errors(scan: Scan, distances: Array, nominal: Array) -> Array:
    """What the lidar of a scan would have said at other true distances: with the errors of the scan itself.

    `nominal` are the true distances at which it said what it did. In whole millimeters: last bits do not spread.
    """
    with np.errstate(invalid="ignore"):
        errors = scan.ranges - nominal
    told = np.round(distances + np.where(np.isfinite(errors), errors, 0.0), 3)
    return clip_to_sensor_range(scan, told)
