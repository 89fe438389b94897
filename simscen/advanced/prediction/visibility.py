"""Free space, remembered as earlier scans: what stands now where one of them saw through has come there.

A wall of which more is seen from another place, and the edge of what is half hidden, were never seen through. So
neither turning nor driving makes static things move, and what drift of the odometry does in the time that is
remembered is less than the margin.
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
"""Meters, and share of the range, by which an earlier beam must have gone farther."""
SLIPPED = (0.05, 0.1, 0.15)
"""Parts of the way between two scans for which the wheels may have turned in vain. What has come must have been free by
each of them: posts beside the way of a fast robot seem to hop from one to the next when all come along a little."""
LEFT = 1.0 - np.array(SLIPPED)[:, None]
"""What is left of the way then."""
AGO, AT_LEAST = 0.9, 0.2
"""Seconds: the least age of the scan that is asked, and while none is so old the least. At 0.25 m/s a thing near by
comes as far as the margin in that time."""
EVERY = 0.19
"""Seconds at least between two that are kept."""
FEWEST_BEAMS = 3
"""Of a scan that can tell."""
TURNED = 0.02
"""rad: what beams beside a point must have gone farther, too: headings that are a second apart are wrong by some of it,
and at an edge it is chance which beam hits."""
SAME, SAME_RELATIVE = 0.12, 0.01
"""Meters, and share of the range, within which an earlier beam must have ended to have hit what stands there now."""
KEPT = 64
"""Scans at most."""
FARTHEST = 1e5
"""Meters: how far a beam saw that met nothing."""


@dataclass(frozen=True)
class View:
    """Where the beams of a lidar go: `count` of them, `increment` rad apart, the first along `start`."""

    count: int
    start: float
    increment: float

    @cached_property
    def full(self) -> bool:
        """Whether it looks all around."""
        return (self.count + 1.5) * self.increment > 2 * math.pi

    @cached_property
    def beside(self) -> int:
        """Beams to either side of a point that must have gone farther than it, too."""
        return max(1, math.ceil(TURNED / self.increment))

    @cached_property
    def around(self) -> Indices:
        """From the number of a beam in `free` to those of the one before it, of itself and of the next in `lengths`."""
        return self.beside + np.array(((-1,), (0,), (1,)))

    @cached_property
    def more(self) -> int:
        """Beams that are added at either end, so that every direction is one's."""
        behind = 0 if self.full else max(0, math.ceil(math.pi / self.increment - self.count / 2))
        return self.beside + 2 + behind

    @cached_property
    def middle(self) -> float:
        """The direction in rad of its middle, …"""
        return self.start + (self.count - 1) / 2 * self.increment

    @cached_property
    def center(self) -> float:
        """… and what that is in beams, those that are added at one end included, but `beside` of them."""
        return self.more - self.beside + (self.count - 1) / 2

    def lengths(self, scan: Scan) -> Array:
        """How far away (n,) the beams of a scan saw, and what is added at either end."""
        lengths = np.zeros(self.count + 2 * self.more)
        seen = lengths[self.more : -self.more]
        np.fmin(np.fmax(scan.ranges, 0.0), FARTHEST, out=seen)
        seen[seen < scan.range_min] = 0.0
        if self.full:
            lengths[: self.more], lengths[-self.more :] = seen[-self.more :], seen[: self.more]
        return lengths

    def free(self, lengths: Array) -> Array:
        """How far away what appears later in each direction stands at most; `beside` shorter at either end."""
        free = _least(lengths, 2 * self.beside + 1)
        free -= MARGIN
        free *= 1.0 / (1.0 + RELATIVE)
        return free


def _least(values: Array, width: int) -> Array:
    """The least of each so many neighbors: of two, of twice as many, …"""
    done = 1
    while done < width:
        step = min(done, width - done)
        values = np.minimum(values[:-step], values[step:])
        done += step
    return values


@fast_dataclass(eq=False)
class Earlier:
    """What a scan saw through, and where its lidar was in the odom frame."""

    tick: int
    lidar: Pose2
    view: View
    lengths: Array
    free: Array

    def looked(self, places: Places, lidar: Pose2) -> "Looked":
        """What it saw of places (n,) that are given as a lidar at `lidar` sees them."""
        moved, ahead = self.lidar.between(lidar), self.view.middle
        turned = places * cmath.rect(1.0, moved.yaw - ahead)
        way = complex(moved.x, moved.y) * cmath.rect(1.0, -ahead)
        return Looked(self, turned, way, *self.towards(turned + way))

    def towards(self, places: Places) -> tuple[Indices, Array]:
        """The beams (…,) that went towards places as it sees them, turned to its middle, and how far off these are.

        Beams have their numbers in `free`.
        """
        beam = np.arctan2(places.imag, places.real)
        beam *= 1.0 / self.view.increment
        beam += self.view.center + 0.5
        return beam.astype(np.int64), np.abs(places)

    def through(self, beam: Indices, distance: Array) -> Mask:
        """Whether beams (…,) went beyond what is so far off."""
        return np.asarray(self.free.take(beam) > distance)


@fast_dataclass(eq=False)
class Looked:
    """The beams (n,) of an earlier scan that went towards places, and how far away these were in m.

    `turned` are the places as seen from where the lidar is now, with the earlier one's headings, and `way` is from the
    one to the other.
    """

    earlier: Earlier
    turned: Places
    way: complex
    beam: Indices
    distance: Array

    def free(self) -> Mask:
        """Which of them were free then. What is farther away than FARTHEST never was."""
        return self.earlier.through(self.beam, self.distance)

    def appeared(self, free: Mask) -> Mask:
        """Which of those that were free were so by each of SLIPPED."""
        earlier, some = self.earlier, free.nonzero()[0]
        appeared: Mask = free.copy()
        if len(some):
            appeared[some] = earlier.through(*earlier.towards(self.turned[some] + LEFT * self.way)).all(axis=0)
        return appeared

    def stood(self) -> Mask:
        """Which of them were hit then, too."""
        off = self.earlier.lengths.take(self.beam + self.earlier.view.around)
        off -= self.distance
        near = np.abs(off, out=off).min(axis=0)
        return np.asarray(near < SAME + SAME_RELATIVE * self.distance)


class FreeSpaceMemory:
    """The newest scans of one lidar."""

    def __init__(self, tick_rate: int) -> None:
        self._ago, self._at_least = round(AGO * tick_rate), round(AT_LEAST * tick_rate)
        self._every = round(EVERY * tick_rate)
        self._scans: deque[Earlier] = deque(maxlen=KEPT)
        self._view = View(0, 0.0, 0.0)

    def remember(self, scan: Scan, lidar: Pose2) -> None:
        """Keep a scan; `lidar` is where it was taken."""
        if self._scans and 0 <= scan.tick - self._scans[-1].tick < self._every:
            return
        view, count = self._view, len(scan.ranges)
        if count < FEWEST_BEAMS or scan.angle_increment <= 0.0:
            return
        if (view.count, view.start, view.increment) != (count, scan.angle_min, scan.angle_increment):
            self._view = view = View(count, scan.angle_min, scan.angle_increment)
        lengths = view.lengths(scan)
        self._scans.append(Earlier(scan.tick, lidar, view, lengths, view.free(lengths)))

    def before(self, tick: int) -> Earlier | None:
        """The scan of about AGO before; None while there is none of AT_LEAST."""
        scans, ago = self._scans, tick - self._ago
        while len(scans) > 1 and scans[1].tick <= ago:
            scans.popleft()
        return scans[0] if scans and scans[0].tick <= tick - self._at_least else None
