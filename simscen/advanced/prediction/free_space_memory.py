"""Comparison of a scan with an earlier scan: which points were free, and which were occupied.

If an earlier beam passed through a point where an obstacle is now, the obstacle has moved there since. No beam passed
through walls that come into view. Therefore, static obstacles do not seem to move when the robot moves.
"""

import cmath
import math
from collections import deque
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simscen.advanced.prediction.clusters import Indices, Mask, Points
from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan

MARGIN_M, MARGIN_RATIO = 0.25, 0.02
"""Margin by which an earlier beam must have passed beyond a free point: a constant, and a share of the range."""
SLIP_RATIOS = (0.05, 0.1, 0.15)
"""Assumed ratios of wheel slip between two scans. New points must have been free for each ratio. Otherwise, posts next
to a fast robot would seem to jump to the next post."""
DISTANCE_RATIOS = 1.0 - np.array(SLIP_RATIOS)[:, None]
"""Ratio of the distance that the robot has driven to the measured distance, for each of SLIP_RATIOS."""
PREFERRED_AGE_S, MIN_AGE_S = 0.9, 0.2
"""Preferred and minimum age of the earlier scan. At 0.25 m/s, an obstacle moves by about MARGIN_M in 0.9 s."""
MIN_INTERVAL_S = 0.19
"""Minimum time between two stored scans."""
MIN_BEAMS = 3
"""Minimum number of beams of a stored scan."""
HEADING_ERROR_RAD = 0.02
"""Angle on each side of a free point within which the earlier beams must also have passed beyond the point."""
SAME_DISTANCE_M, SAME_DISTANCE_RATIO = 0.12, 0.01
"""Maximum difference of the distances of the same obstacle in two scans: a constant, and a share of the range."""
MAX_SCANS = 64
"""Maximum number of stored scans."""
NO_HIT_RANGE_M = 1e5
"""Range of a beam that hit nothing."""


@dataclass(frozen=True)
class ScanGeometry:
    """Directions of the `count` beams of a lidar, `increment` rad apart. The first beam points along `start` (rad)."""

    count: int
    start: float
    increment: float

    @cached_property
    def is_full_circle(self) -> bool:
        """Whether the field of view is a full circle."""
        return (self.count + 1.5) * self.increment > 2 * math.pi

    @cached_property
    def neighbors(self) -> int:
        """Number of beams within HEADING_ERROR_RAD to each side."""
        return max(1, math.ceil(HEADING_ERROR_RAD / self.increment))

    @cached_property
    def neighbor_offsets(self) -> Indices:
        """Offsets (3, 1) from an index in `free_distances` to the previous, same, and next beam in `padded_ranges`."""
        return self.neighbors + np.array(((-1,), (0,), (1,)))

    @cached_property
    def padding(self) -> int:
        """Number of beams added at each end of a scan, so that there is a beam in each direction."""
        missing = 0 if self.is_full_circle else max(0, math.ceil(math.pi / self.increment - self.count / 2))
        return self.neighbors + 2 + missing

    @cached_property
    def center_direction(self) -> float:
        """Direction in rad of the center of the field of view, in the lidar frame."""
        return self.start + (self.count - 1) / 2 * self.increment

    @cached_property
    def center_index(self) -> float:
        """Index of the center of the field of view in `free_distances`."""
        return self.padding - self.neighbors + (self.count - 1) / 2

    def padded_ranges(self, scan: Scan) -> Array:
        """Return the ranges of a scan with `padding` beams added at each end.

        The added ranges are copies from the other end if the field of view is a full circle, otherwise 0.
        """
        padded = np.zeros(self.count + 2 * self.padding)
        measured = padded[self.padding : -self.padding]
        np.fmin(np.fmax(scan.ranges, 0.0), NO_HIT_RANGE_M, out=measured)
        measured[measured < scan.range_min] = 0.0
        if self.is_full_circle:
            padded[: self.padding], padded[-self.padding :] = measured[-self.padding :], measured[: self.padding]
        return padded

    def free_distances(self, padded_ranges: Array) -> Array:
        """Return the distance in m along each beam up to which space was surely free.

        The array is shorter than `padded_ranges` by `neighbors` at each end.
        """
        free = _sliding_minimum(padded_ranges, 2 * self.neighbors + 1)
        free -= MARGIN_M
        free *= 1.0 / (1.0 + MARGIN_RATIO)
        return free


def _sliding_minimum(values: Array, width: int) -> Array:
    """Return the minimum of each `width` neighbors."""
    combined = 1
    while combined < width:
        step = min(combined, width - combined)
        values = np.minimum(values[:-step], values[step:])
        combined += step
    return values


@fast_dataclass(eq=False)
class EarlierScan:
    """Free space of an earlier scan.

    `lidar` is the pose of the lidar in the odom frame. ScanGeometry describes `padded_ranges` and `free_distances`.
    """

    tick: int
    lidar: Pose2
    geometry: ScanGeometry
    padded_ranges: Array
    free_distances: Array

    def compare(self, points: Points, lidar: Pose2) -> "BeamComparison":
        """Compare points (n,) in the frame of the current lidar, whose pose in the odom frame is `lidar`."""
        motion, center_direction = self.lidar.between(lidar), self.geometry.center_direction
        rotated = points * cmath.rect(1.0, motion.yaw - center_direction)
        displacement = complex(motion.x, motion.y) * cmath.rect(1.0, -center_direction)
        return BeamComparison(self, rotated, displacement, *self.beams_toward(rotated + displacement))

    def beams_toward(self, points: Points) -> tuple[Indices, Array]:
        """Return the indices in `free_distances` of the beams toward points (…,), and the distances of the points in m.

        Points are relative to this lidar, with the x-axis along the center of its field of view.
        """
        beam = np.arctan2(points.imag, points.real)
        beam *= 1.0 / self.geometry.increment
        beam += self.geometry.center_index + 0.5
        return beam.astype(np.int64), np.abs(points)

    def passed_beyond(self, beam: Indices, distance: Array) -> Mask:
        """Return which beams (indices in `free_distances`) surely passed beyond the distances in m, both (…,)."""
        return np.asarray(self.free_distances.take(beam) > distance)


@fast_dataclass(eq=False)
class BeamComparison:
    """Beams of an earlier scan toward n points.

    rotated:       points (n,) relative to the current lidar, along the axes of the earlier scan
    displacement:  vector from the earlier lidar to the current one, along the same axes
    beam:          indices (n,) in `free_distances` of the beams toward the points
    distance:      distances (n,) in m of the points from the earlier lidar
    """

    earlier: EarlierScan
    rotated: Points
    displacement: complex
    beam: Indices
    distance: Array

    def has_appeared(self) -> Mask:
        """Return which points were free in the earlier scan for each of SLIP_RATIOS, and without slip.

        Points beyond the maximum range of the lidar do not count as free.
        """
        earlier = self.earlier
        has_appeared = earlier.passed_beyond(self.beam, self.distance)
        indices = has_appeared.nonzero()[0]
        if len(indices):
            has_appeared[indices] = earlier.passed_beyond(
                *earlier.beams_toward(self.rotated[indices] + DISTANCE_RATIOS * self.displacement)
            ).all(axis=0)
        return has_appeared

    def was_occupied(self) -> Mask:
        """Return at which of the points the earlier scan hit something."""
        difference = self.earlier.padded_ranges.take(self.beam + self.earlier.geometry.neighbor_offsets)
        difference -= self.distance
        closest = np.abs(difference, out=difference).min(axis=0)
        return np.asarray(closest < SAME_DISTANCE_M + SAME_DISTANCE_RATIO * self.distance)


class FreeSpaceMemory:
    """Stores recent scans of one lidar, to compare later scans with."""

    def __init__(self, tick_rate: int) -> None:
        self._preferred_age, self._min_age = round(PREFERRED_AGE_S * tick_rate), round(MIN_AGE_S * tick_rate)
        self._min_interval = round(MIN_INTERVAL_S * tick_rate)
        self._scans: deque[EarlierScan] = deque(maxlen=MAX_SCANS)
        self._geometry = ScanGeometry(0, 0.0, 0.0)

    def add(self, scan: Scan, lidar: Pose2) -> None:
        """Store a scan taken with the lidar at a pose in the odom frame, unless the last stored scan is too recent."""
        if self._scans and 0 <= scan.tick - self._scans[-1].tick < self._min_interval:
            return
        geometry, count = self._geometry, len(scan.ranges)
        if count < MIN_BEAMS or scan.angle_increment <= 0.0:
            return
        if (geometry.count, geometry.start, geometry.increment) != (count, scan.angle_min, scan.angle_increment):
            self._geometry = geometry = ScanGeometry(count, scan.angle_min, scan.angle_increment)
        padded = geometry.padded_ranges(scan)
        free = geometry.free_distances(np.minimum(padded, scan.range_max))  # nothing is known beyond the maximum range
        self._scans.append(EarlierScan(scan.tick, lidar, geometry, padded, free))

    def scan_before(self, tick: int) -> EarlierScan | None:
        """Return the scan about PREFERRED_AGE_S before a tick; None if no scan is at least MIN_AGE_S before it.

        Older scans are dropped, so the ticks of consecutive calls must not decrease.
        """
        scans, latest = self._scans, tick - self._preferred_age
        while len(scans) > 1 and scans[1].tick <= latest:
            scans.popleft()
        return scans[0] if scans and scans[0].tick <= tick - self._min_age else None
