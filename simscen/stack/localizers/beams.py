"""Selection of the beams of a scan that a particle filter compares with the map."""

import cmath
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Scan

ComplexPoints = npt.NDArray[np.complex128]
"""Points or directions as complex numbers x + iy."""
TableIndices = npt.NDArray[np.int32]
"""Flat indices into a lookup table over the cells of a map."""


class Field(Protocol):
    """Lookup table over the cells of a map, for example of distances to obstacles."""

    def endpoint_cells(self, poses: Array, points: ComplexPoints) -> TableIndices:
        """Return the table indices (n, b) of `points` (b,), given in the base frame of each of the `poses` (n, 3)."""
        ...


@dataclass(frozen=True, eq=False)
class Beams:
    """The b valid beams of a scan, of which m beams hit something.

    ranges:        ranges (b,) in m; `range_max` for beams without a hit
    unit_vectors:  unit vectors (b,) along the beams in the base frame
    origin:        position x + iy of the lidar in the base frame
    range_max:     maximum range in m
    """

    ranges: Array
    unit_vectors: ComplexPoints
    origin: complex
    range_max: float

    @property
    def bearings(self) -> Array:
        """Directions (b,) of the beams in the base frame, in rad."""
        return np.angle(self.unit_vectors)

    @cached_property
    def ends(self) -> ComplexPoints:
        """Endpoints (m,) in the base frame of the beams that hit something."""
        hits = (self.ranges < self.range_max).nonzero()[0]
        return self.ranges.take(hits) * self.unit_vectors.take(hits) + self.origin

    def cells(self, field: Field, poses: Array) -> TableIndices:
        """Return the indices (n, m) of the endpoints in the table `field`, for each of the `poses` (n, 3). Cached."""
        last: tuple[Field, Array, TableIndices] | None = self.__dict__.get("_cells")
        if last is None or last[0] is not field or last[1] is not poses:
            last = self.__dict__["_cells"] = field, poses, field.endpoint_cells(poses, self.ends)
        return last[2]

    def with_hits(self, chosen: npt.NDArray[np.bool_]) -> "Beams":
        """Return the beams with the hits that the mask `chosen` (m,) selects, and all beams without a hit."""
        is_kept = self.ranges >= self.range_max
        is_kept[(~is_kept).nonzero()[0][chosen]] = True
        return Beams(self.ranges[is_kept], self.unit_vectors[is_kept], self.origin, self.range_max)


def directions(scan: Scan) -> ComplexPoints:
    """Return read-only unit vectors (n,) along the beams of a scan, in the base frame."""
    return _directions(scan.angle_min, scan.angle_increment, len(scan.ranges), scan.mount.yaw)


@lru_cache(maxsize=1024)
def evenly_spaced(count: int, chosen_count: int) -> npt.NDArray[np.int64]:
    """Return `chosen_count` read-only indices, evenly spaced over `count` items."""
    chosen: npt.NDArray[np.int64] = np.linspace(0, count - 1, chosen_count).astype(np.int64)
    chosen.flags.writeable = False
    return chosen


@lru_cache(maxsize=8)
def _directions(first: float, increment: float, count: int, turn: float) -> ComplexPoints:
    """Return the unit vectors along `count` beams. `turn` is the yaw of the lidar in the base frame. Cached."""
    angles = first + increment * np.arange(count, dtype=np.float64)
    unit_vectors: ComplexPoints = (np.cos(angles) + 1j * np.sin(angles)) * cmath.rect(1.0, turn)
    unit_vectors.flags.writeable = False
    return unit_vectors


def select_beams(scan: Scan, count: int, min_range: float, max_range: float) -> Beams:
    """Return at most `count` evenly spaced beams of a scan, without beams that have an invalid range (nan).

    The maximum range is the smaller of `max_range` and the lidar's maximum. As in nav2_amcl, ranges up to `min_range`,
    or up to the lidar's minimum, are replaced by the maximum range.
    """
    step = -(-len(scan.ranges) // count) or 1
    ranges, unit_vectors = scan.ranges[::step], directions(scan)[::step]
    range_max, range_min = min(scan.range_max, max_range), max(scan.range_min, min_range)
    if np.count_nonzero(is_invalid := np.isnan(ranges)):
        ranges, unit_vectors = ranges[~is_invalid], unit_vectors[~is_invalid]
    ranges = np.where((ranges > range_min) & (ranges < range_max), ranges, range_max)
    return Beams(ranges, unit_vectors, complex(scan.mount.x, scan.mount.y), range_max)
