"""Clusters of a scan: runs of neighboring beams that hit the same obstacle, and the cylinder that fits them."""

import cmath
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array

GAP, SPARSE = 0.15, 2.5
"""Maximum distance between hits of one cluster: in m, or as a multiple of the beam spacing."""
MISSED = 2
"""Maximum number of consecutive beams without a hit within a cluster."""
VALLEY = 0.1
"""Minimum rise of the range in m between two obstacles that are neighbors in the scan."""
BOTH = 2
"""Number of visible edges of a completely visible obstacle."""
STEP_APART = 1e3
"""A distance in m larger than any range."""
STEEPEST = math.radians(80.0)
"""Limit in rad of half the angle that a cluster covers, for computing its radius."""
FEWEST = 3
"""Minimum number of hits of a cluster."""
ROUNDING = 1e-6
"""Tolerance in m for rounding."""
STEPS, ENOUGH = 4, 3e-3
"""Maximum number of Gauss-Newton iterations, and the step in m below which they end."""

Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.complex128]
"""Points (n,) as complex numbers, x + iy: to turn them is one multiplication."""


@fast_dataclass(eq=False)
class Hits:
    """Hits of a scan in order: indices of `beams`, `ranges`, and `places` (m,).

    Two successive hits belong together if their distance is at most `sparse` times the range.
    """

    beams: Indices
    ranges: Array
    places: Places
    sparse: float

    def may_be_together(self, which: list[int], few: int) -> bool:
        """Return whether `few` of these successive hits may be in one run."""
        row = 1
        for one, other in pairwise(which):
            row = row + 1 if self._linked(one) and self._linked(other - 1) else 1
            if row == few:
                return True
        return False

    def _linked(self, hit: int) -> bool:
        """Return whether the next hit may belong to this one, computed with scalars."""
        here, there = self.places.item(hit), self.places.item(hit + 1)
        near = min(self.ranges.item(hit), self.ranges.item(hit + 1))
        return abs(there - here) <= max(self.sparse * near, GAP) + ROUNDING


@fast_dataclass(eq=False)
class Runs:
    """Hits divided into runs of neighbors that are close together. Run k contains the hits `first[k]` … `last[k]`."""

    hits: Hits
    first: Indices
    last: Indices

    def together(self, which: Mask, few: int) -> bool:
        """Return whether at least `few` (more than one) of these hits (m,) are in one run."""
        runs = self.first.searchsorted(which.nonzero()[0], side="right")
        return bool((runs[few - 1 :] == runs[: 1 - few]).any())


class Cluster(NamedTuple):
    """Cluster of the hits `first` … `last` of a scan, in the lidar frame.

    `center` (x + iy) and `radius` in m are those of the cylinder that covers the same angle at the same distance.
    `edges` is the number of its ends that are visible, i.e. not hidden by a closer obstacle or the end of the scan.
    """

    first: int
    last: int
    center: complex
    radius: float
    edges: int

    @property
    def hits(self) -> int:
        """Number of hits."""
        return self.last - self.first + 1


def valid_hits(ranges: Array, places: Places, step: float, least: float, most: float) -> Hits:
    """Return the hits of a scan with ranges between `least` and `most` m.

    `places` (n,) are the ends of the beams, which are `step` rad apart.
    """
    beams = ((ranges >= least) & (ranges <= most)).nonzero()[0]
    return Hits(beams, ranges[beams], places[beams], SPARSE * abs(step))


def runs(hits: Hits) -> Runs:
    """Return the runs of hits. The first and the last run of a full circle are not joined."""
    beams, ranges, places = hits.beams, hits.ranges, hits.places
    gap = np.minimum(ranges[1:], ranges[:-1])
    gap *= hits.sparse
    apart = np.abs(places[1:] - places[:-1]) > np.maximum(gap, GAP, out=gap)
    if len(beams) and beams[-1] - beams[0] >= len(beams):
        apart |= beams[1:] - beams[:-1] > MISSED + 1
    return Runs(hits, *_between(apart.nonzero()[0], len(ranges)))


def clusters(found: Runs, scanned: Array, start: float, step: float, largest: float) -> list[Cluster]:
    """Return the clusters with a radius up to `largest` in a scan with ranges `scanned` and these runs.

    The first beam points along `start`; beams are `step` rad apart.
    """
    wide = abs(step)
    hits = found.hits
    if len(hits.beams) < FEWEST:
        return []
    first, last = _parted(hits.ranges, found.first, found.last)
    nearest = np.minimum.reduceat(hits.ranges, first).tolist()
    full = abs(len(scanned) * wide - 2 * math.pi) < wide
    pieces: list[Cluster] = []
    begin, end = hits.beams.take(first).tolist(), hits.beams.take(last).tolist()
    for one, other, near, low, high in zip(first, last, nearest, begin, end, strict=True):
        if other - one + 1 < FEWEST:
            continue
        sine = math.sin(min((high - low + 1) * (0.5 * wide), STEEPEST))
        radius = near * sine / (1.0 - sine)
        if radius <= largest:
            center = cmath.rect(near + radius, start + (0.5 * step) * (low + high))
            edges = _clear(scanned, low, low - 1, full) + _clear(scanned, high, high + 1, full)
            pieces.append(Cluster(one, other, center, radius, edges))
    return pieces


def _clear(ranges: Array, beam: int, beside: int, full_circle: bool) -> bool:
    """Return whether the beam `beside` has a longer range than `beam`."""
    if not 0 <= beside < len(ranges):
        if not full_circle:
            return False
        beside %= len(ranges)
    return bool(ranges[beside] > ranges[beam])


def marked_hits(pieces: list[Cluster], which: Mask) -> list[tuple[int, int]]:
    """Return for each cluster how many of its hits are marked in `which` (m,), and how many it has."""
    told = which.tobytes()
    return [(told.count(1, first, last + 1), last + 1 - first) for first, last, *_ in pieces]


def _between(breaks: Indices, count: int) -> tuple[Indices, Indices]:
    """Return the first and last indices of the runs of `count` hits that are separated after `breaks` (k,)."""
    if not count:
        return breaks, breaks
    first, last = np.zeros(len(breaks) + 1, np.int64), np.empty(len(breaks) + 1, np.int64)
    np.add(breaks, 1, out=first[1:])
    last[:-1], last[-1] = breaks, count - 1
    return first, last


def _parted(ranges: Array, first: Indices, last: Indices) -> tuple[list[int], list[int]]:
    """Return the first and last hits of runs, divided where two adjacent obstacles meet.

    Along one convex obstacle, the range falls to its closest point and then rises. A local maximum of the range
    therefore separates two obstacles.
    """
    # All runs are processed at once. An offset that increases from run to run keeps them independent.
    count = last - first + 1
    steps = np.repeat(STEP_APART * np.arange(len(first)), count)
    after = ranges + steps
    after -= np.minimum.accumulate(after[::-1])[::-1]
    before = np.subtract(ranges, steps, out=steps)
    before -= np.minimum.accumulate(before)
    rise = np.maximum.reduceat(np.minimum(before, after, out=before), first)
    begin, end = first.tolist(), last.tolist()
    for number in ((rise > VALLEY) & (count >= 2 * FEWEST)).nonzero()[0].tolist()[::-1]:
        cut = slice(number, number + 1)
        begin[cut], end[cut] = zip(*_parts(ranges, begin[number], end[number]), strict=True)
    return begin, end


def _parts(ranges: Array, begin: int, end: int) -> list[tuple[int, int]]:
    """Return the parts of one run, in order."""
    left = [(begin, end)]
    parts: list[tuple[int, int]] = []
    while left:
        begin, end = left.pop()
        if end - begin + 1 >= 2 * FEWEST:
            piece = ranges[begin : end + 1]
            before, after = np.minimum.accumulate(piece), np.minimum.accumulate(piece[::-1])[::-1]
            rise = piece - np.maximum(before, after)
            valley = int(rise.argmax())
            if rise[valley] > VALLEY:
                left += [(begin + valley + 1, end), (begin, begin + valley)]
                continue
        parts.append((begin, end))
    return parts


def fit_circle(arc: list[complex], radius: float, center: complex) -> complex:
    """Return the center of the circle with this radius that fits points x + iy best; `center` is the initial guess.

    Computed with scalars, because a dozen points are too few for arrays.
    """
    half = 0.52 * len(arc)  # slightly damped, because a short arc does not determine the lateral position
    for _ in range(STEPS):
        squares = miss = 0j
        for place in arc:
            off = center - place
            distance = abs(off)
            towards = off / max(distance, 1e-6)
            # The squares of unit vectors x + iy sum up to x² - y² + 2ixy, their squared lengths to their number.
            squares += towards * towards
            miss += towards * (distance - radius)
        square = squares / 2
        change = (half * miss - square * miss.conjugate()) / (half * half - abs(square) ** 2)
        center -= change
        if abs(change) < ENOUGH:
            break
    return center
