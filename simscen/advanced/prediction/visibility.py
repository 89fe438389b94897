"""Memory of free space as earlier scans: what is now where an earlier beam passed through has appeared since.

Parts of a wall that come into view, and the edges of hidden obstacles, were never passed by a beam. Therefore static
obstacles do not seem to move when the robot moves. The drift of odometry within this time is less than the margin.
"""

import cmath
import math
from collections import deque
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simscen.advanced.prediction.clusters import Indices, Mask, Places
from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan

MARGIN, RELATIVE = 0.25, 0.02
"""Margin, in m and as a share of the range, by which an earlier beam must have passed a point."""
SLIPPED = (0.05, 0.1, 0.15)
"""Assumed wheel slip between two scans, as shares of the distance. A new obstacle must be new for each of them;
otherwise, posts beside a fast robot seem to jump to the next post."""
LEFT = 1.0 - np.array(SLIPPED)[:, None]
"""Remaining share of the distance."""
AGO, AT_LEAST = 0.9, 0.2
"""Preferred and minimum age in s of the earlier scan. At 0.25 m/s, an obstacle moves by the margin in the former."""
EVERY = 0.19
"""Minimum time in s between two scans that are kept."""
FEWEST_BEAMS = 3
"""Minimum number of beams of a scan."""
TURNED = 0.02
"""Angle in rad to both sides of a point within which earlier beams must have passed too, for errors of the heading."""
SAME, SAME_RELATIVE = 0.12, 0.01
"""Tolerance, in m and as a share of the range, for an earlier beam to have hit the same obstacle."""
KEPT = 64
"""Maximum number of scans that are kept."""
FARTHEST = 1e5
"""Range in m of a beam that hit nothing."""


@dataclass(frozen=True)
class ScanGeometry:
    """Directions of the beams of a lidar: `count` beams, `increment` rad apart, the first along `start`."""

    count: int
    start: float
    increment: float

    @cached_property
    def full(self) -> bool:
        """Whether the field of view is a full circle."""
        return (self.count + 1.5) * self.increment > 2 * math.pi

    @cached_property
    def beside(self) -> int:
        """Number of beams to each side of a point that must have passed it as well."""
        return max(1, math.ceil(TURNED / self.increment))

    @cached_property
    def around(self) -> Indices:
        """Offsets from the index of a beam in `free` to the previous, the same, and the next beam in `lengths`."""
        return self.beside + np.array(((-1,), (0,), (1,)))

    @cached_property
    def more(self) -> int:
        """Number of beams added at each end, so that each direction has a beam."""
        behind = 0 if self.full else max(0, math.ceil(math.pi / self.increment - self.count / 2))
        return self.beside + 2 + behind

    @cached_property
    def middle(self) -> float:
        """Direction in rad of the center."""
        return self.start + (self.count - 1) / 2 * self.increment

    @cached_property
    def center(self) -> float:
        """Index of the center in `free`."""
        return self.more - self.beside + (self.count - 1) / 2

    def lengths(self, scan: Scan) -> Array:
        """Return the ranges (n,) of a scan, with the beams added at each end."""
        lengths = np.zeros(self.count + 2 * self.more)
        seen = lengths[self.more : -self.more]
        np.fmin(np.fmax(scan.ranges, 0.0), FARTHEST, out=seen)
        seen[seen < scan.range_min] = 0.0
        if self.full:
            lengths[: self.more], lengths[-self.more :] = seen[-self.more :], seen[: self.more]
        return lengths

    def free(self, lengths: Array) -> Array:
        """Return the maximum distance of a new obstacle in each direction; shorter by `beside` at each end."""
        free = _least(lengths, 2 * self.beside + 1)
        free -= MARGIN
        free *= 1.0 / (1.0 + RELATIVE)
        return free


def _least(values: Array, width: int) -> Array:
    """Return the minimum of each `width` neighbors."""
    done = 1
    while done < width:
        step = min(done, width - done)
        values = np.minimum(values[:-step], values[step:])
        done += step
    return values


@fast_dataclass(eq=False)
class EarlierScan:
    """Free space of an earlier scan, and the pose of its lidar in the odom frame."""

    tick: int
    lidar: Pose2
    view: ScanGeometry
    lengths: Array
    free: Array

    def looked(self, places: Places, lidar: Pose2) -> "BeamComparison":
        """Compare places (n,), given in the frame of a lidar at `lidar`, with this scan."""
        moved, ahead = self.lidar.between(lidar), self.view.middle
        turned = places * cmath.rect(1.0, moved.yaw - ahead)
        way = complex(moved.x, moved.y) * cmath.rect(1.0, -ahead)
        return BeamComparison(self, turned, way, *self.towards(turned + way))

    def towards(self, places: Places) -> tuple[Indices, Array]:
        """Return the indices in `free` of the beams (…,) toward places, and the distances of the places.

        Places are in this lidar's frame, rotated to its center direction.
        """
        beam = np.arctan2(places.imag, places.real)
        beam *= 1.0 / self.view.increment
        beam += self.view.center + 0.5
        return beam.astype(np.int64), np.abs(places)

    def through(self, beam: Indices, distance: Array) -> Mask:
        """Return whether beams (…,) passed beyond a distance."""
        return np.asarray(self.free.take(beam) > distance)


@fast_dataclass(eq=False)
class BeamComparison:
    """Beams (n,) of an earlier scan toward places, with the distances of the places in m.

    `turned` are the places relative to the current lidar in the earlier orientation; `way` is the displacement between
    both lidar poses.
    """

    earlier: EarlierScan
    turned: Places
    way: complex
    beam: Indices
    distance: Array

    def free(self) -> Mask:
        """Return which places were free then. Places beyond FARTHEST were not."""
        return self.earlier.through(self.beam, self.distance)

    def appeared(self, free: Mask) -> Mask:
        """Return which of the free places were free for each of the assumed slips."""
        earlier, some = self.earlier, free.nonzero()[0]
        appeared: Mask = free.copy()
        if len(some):
            appeared[some] = earlier.through(*earlier.towards(self.turned[some] + LEFT * self.way)).all(axis=0)
        return appeared

    def stood(self) -> Mask:
        """Return which places were also hit then."""
        off = self.earlier.lengths.take(self.beam + self.earlier.view.around)
        off -= self.distance
        near = np.abs(off, out=off).min(axis=0)
        return np.asarray(near < SAME + SAME_RELATIVE * self.distance)


class FreeSpaceMemory:
    """Recent scans of one lidar."""

    def __init__(self, tick_rate: int) -> None:
        """Take the tick rate in Hz."""
        self._ago, self._at_least = round(AGO * tick_rate), round(AT_LEAST * tick_rate)
        self._every = round(EVERY * tick_rate)
        self._scans: deque[EarlierScan] = deque(maxlen=KEPT)
        self._view = ScanGeometry(0, 0.0, 0.0)

    def remember(self, scan: Scan, lidar: Pose2) -> None:
        """Keep a scan, taken with the lidar at a pose."""
        if self._scans and 0 <= scan.tick - self._scans[-1].tick < self._every:
            return
        view, count = self._view, len(scan.ranges)
        if count < FEWEST_BEAMS or scan.angle_increment <= 0.0:
            return
        if (view.count, view.start, view.increment) != (count, scan.angle_min, scan.angle_increment):
            self._view = view = ScanGeometry(count, scan.angle_min, scan.angle_increment)
        lengths = view.lengths(scan)
        self._scans.append(EarlierScan(scan.tick, lidar, view, lengths, view.free(lengths)))

    def before(self, tick: int) -> EarlierScan | None:
        """Return the scan that is about AGO old, or None if there is none older than AT_LEAST."""
        scans, ago = self._scans, tick - self._ago
        while len(scans) > 1 and scans[1].tick <= ago:
            scans.popleft()
        return scans[0] if scans and scans[0].tick <= tick - self._at_least else None
