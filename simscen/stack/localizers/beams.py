"""The beams of a scan that a particle filter looks at."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.sensing import Scan


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams that gave an answer.

    `ranges` (b,) in m, at most `range_max`, which means that nothing was hit; `bearings` (b,) in the base frame in
    rad; `origin` is the lidar's place in the base frame.
    """

    ranges: Array
    bearings: Array
    origin: tuple[float, float]
    range_max: float

    def ends(self) -> Array:
        """Where the beams that hit something ended: points (m, 2) in the base frame."""
        hit = self.ranges < self.range_max
        ranges, bearings = self.ranges[hit], self.bearings[hit]
        return np.column_stack((ranges * np.cos(bearings), ranges * np.sin(bearings))) + self.origin


def directions(scan: Scan) -> Array:
    """Unit vectors (n, 2) along the beams of a scan, in the lidar's frame; not to be written to."""
    return _directions(scan.angle_min, scan.angle_increment, len(scan.ranges))


@lru_cache(maxsize=1024)
def evenly(count: int, most: int) -> npt.NDArray[np.int64]:
    """Indices (most,) of so many of `count` things, evenly chosen; not to be written to."""
    chosen: npt.NDArray[np.int64] = np.linspace(0, count - 1, most).astype(np.int64)
    chosen.flags.writeable = False
    return chosen


@lru_cache(maxsize=8)
def _directions(first: float, increment: float, count: int) -> Array:
    """Beams of a lidar point the same ways in all its scans."""
    angles = first + increment * np.arange(count, dtype=np.float64)
    towards = np.column_stack((np.cos(angles), np.sin(angles)))
    towards.flags.writeable = False
    return towards


def select_beams(scan: Scan, count: int, least: float, most: float) -> Beams:
    """Every k-th beam, so that there are at most `count`, without those that are nan.

    Ranges are cut at `most` and the lidar's own maximum. Those not above `least` and the lidar's own minimum count as
    maximal: nav2_amcl has no notion of too near either.
    """
    step = -(-len(scan.ranges) // count) or 1
    ranges = scan.ranges[::step]
    range_max, range_min = min(scan.range_max, most), max(scan.range_min, least)
    answered = ~np.isnan(ranges)
    with np.errstate(invalid="ignore"):
        usable = (ranges > range_min) & (ranges < range_max)
    ranges = np.where(usable, ranges, range_max)
    bearings = scan.mount.yaw + scan.angles()[::step]
    return Beams(ranges[answered], bearings[answered], (scan.mount.x, scan.mount.y), range_max)
