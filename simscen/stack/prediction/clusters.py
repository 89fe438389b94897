"""A scan in pieces: runs of neighbouring beams that hit the same thing, and the cylinder that would look like that."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

GAP, SPARSE = 0.15, 2.5
"""Two hits belong together when they are no farther apart than this many metres, or times the spacing of beams."""
MISSED = 2
"""Beams that may miss within a piece."""
VALLEY = 0.1
"""Metres by which the range must rise between two things that touch, as the scan sees them."""
BOTH = 2
"""Edges of what is seen whole."""
STEP_APART = 1e3
"""Metres: more than any beam sees."""
STEEPEST = math.radians(80.0)
"""Half the angle that a piece fills at most, as far as its radius is concerned."""
OUTWARD = np.array(((-1,), (1,)))
FEWEST = 3
"""Hits of a piece that is looked at."""
STEPS, ENOUGH = 4, 3e-3
"""Of Gauss-Newton: from half a radius off, a circle is found to a millimetre; metres of a step that is the last."""

Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.complex128]
"""Points (n,) as complex numbers, x + iy: to turn them is one multiplication."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Hits of a scan, of which neighbours that are not far apart make a run: things that stand apart.

    `ranges` and `places` (m,) are of the hits, which `beams` made; a run is the hits `first[k]` … `last[k]`.
    """

    beams: Indices
    ranges: Array
    places: Places
    first: Indices
    last: Indices

    def most(self, which: Mask) -> int:
        """How many of a run's hits these (m,) are at most."""
        return int(np.add.reduceat(which, self.first, dtype=np.int64).max()) if len(which) else 0


@dataclass(frozen=True, eq=False)
class Clusters:
    """Pieces of a scan, in the lidar's frame.

    Piece k is the hits `first[k]` … `last[k]` of `places` (m,). `centres` (n,) and `radii` (n,) are of the cylinders
    that fill the same angle at the same distance. `edges` (n,): at how many of its two ends nothing nearer stands, nor
    the scan ends; at BOTH, all of it is seen.
    """

    places: Places
    first: Indices
    last: Indices
    centres: Places
    radii: Array
    edges: Indices

    def counts(self, which: Mask) -> tuple[Indices, Array]:
        """How many (n,) of each piece's hits these (m,) are, and the share."""
        total = np.zeros(len(which) + 1, np.int64)
        np.cumsum(which, out=total[1:])
        count = total[self.last + 1] - total[self.first]
        return count, count / (self.last - self.first + 1)


def runs(ranges: Array, places: Places, step: float, least: float, most: float) -> Runs:
    """The runs of a scan of beams that answer between `least` and `most` metres, each `step` rad further.

    `places` (n,) are what they hit. A circle's first and last run are not joined: what lies behind the robot across the
    seam is two.
    """
    beams = ((ranges >= least) & (ranges <= most)).nonzero()[0]
    r, hits = ranges[beams], places[beams]
    gap = np.minimum(r[1:], r[:-1])
    gap *= SPARSE * abs(step)
    apart = np.abs(hits[1:] - hits[:-1]) > np.maximum(gap, GAP, out=gap)
    if len(beams) and beams[-1] - beams[0] >= len(beams):
        apart |= beams[1:] - beams[:-1] > MISSED + 1
    return Runs(beams, r, hits, *_between(apart.nonzero()[0], len(r)))


def clusters(found: Runs, scanned: Array, start: float, step: float, largest: float) -> Clusters:
    """The pieces of a scan of ranges `scanned` in which these runs were found, none with a radius over `largest`.

    The first beam goes along `start`, the next `step` rad further.
    """
    beams, r, wide = found.beams, found.ranges, abs(step)
    if len(beams) < FEWEST:
        none = np.zeros(0, dtype=np.int64)
        return Clusters(found.places[:0], none, none, found.places[:0], np.zeros(0), none)
    first, last = _parted(r, found.first, found.last)
    ends = beams[np.array((first, last))]
    sine = np.sin(np.minimum((ends[1] - ends[0] + 1) * (0.5 * wide), STEEPEST))
    nearest = np.minimum.reduceat(r, first)
    radii = nearest * sine / (1.0 - sine)
    few = ((radii <= largest) & (last - first + 1 >= FEWEST)).nonzero()[0]
    first, last, radii, ends = first[few], last[few], radii[few], ends[:, few]
    middle = start + (0.5 * step) * (ends[0] + ends[1])
    centres = (nearest[few] + radii) * np.exp(1j * middle)
    full = abs(len(scanned) * wide - 2 * math.pi) < wide
    return Clusters(found.places, first, last, centres, radii, _clear(scanned, ends, full))


def _between(breaks: Indices, count: int) -> tuple[Indices, Indices]:
    """First and last of so many hits in a row that is parted after these (k,)."""
    if not count:
        return breaks, breaks
    first, last = np.zeros(len(breaks) + 1, np.int64), np.empty(len(breaks) + 1, np.int64)
    np.add(breaks, 1, out=first[1:])
    last[:-1], last[-1] = breaks, count - 1
    return first, last


def _parted(ranges: Array, first: Indices, last: Indices) -> tuple[Indices, Indices]:
    """Pieces cut where two things that touch meet: there the range is greater than somewhere to either side.

    Along one convex thing it falls to its nearest point and then rises, whatever its shape.
    """
    # Of all pieces at once, each a step below or above the one before: so none knows of the others.
    count = last - first + 1
    steps = np.repeat(STEP_APART * np.arange(len(first)), count)
    after = ranges + steps
    after -= np.minimum.accumulate(after[::-1])[::-1]
    before = np.subtract(ranges, steps, out=steps)
    before -= np.minimum.accumulate(before)
    rise = np.maximum.reduceat(np.minimum(before, after, out=before), first)
    cut = (rise > VALLEY) & (count >= 2 * FEWEST)
    if not cut.any():
        return first, last
    parted = list(zip(first[~cut].tolist(), last[~cut].tolist(), strict=True))
    edges = list(zip(first[cut].tolist(), last[cut].tolist(), strict=True))
    while edges:
        begin, end = edges.pop()
        if end - begin + 1 >= 2 * FEWEST:
            piece = ranges[begin : end + 1]
            before, after = np.minimum.accumulate(piece), np.minimum.accumulate(piece[::-1])[::-1]
            rise = piece - np.maximum(before, after)
            valley = int(rise.argmax())
            if rise[valley] > VALLEY:
                edges += [(begin, begin + valley), (begin + valley + 1, end)]
                continue
        parted.append((begin, end))
    parted.sort()
    pieces: Indices = np.array(parted, dtype=np.int64)
    return pieces[:, 0], pieces[:, 1]


def _clear(ranges: Array, ends: Indices, full_circle: bool) -> Indices:
    """At how many of their two ends (2, n), beams of `ranges`, the beam beside pieces (n,) goes on beyond them."""
    beside = ends + OUTWARD
    beyond = ranges[beside % len(ranges)] > ranges[ends]
    if not full_circle:
        beyond &= (beside >= 0) & (beside < len(ranges))
    return np.asarray(np.add(beyond[0], beyond[1], dtype=np.int64))


def fitted(pieces: Clusters, which: Indices, centres: Places, radii: Array) -> Places:
    """The centres (k,) of the circles of these radii (k,) that fit the arcs of `which` (k,) pieces best.

    `centres` (k,) are a first guess.
    """
    first, count = pieces.first[which], pieces.last[which] - pieces.first[which] + 1
    begin = np.cumsum(count) - count
    owner = np.repeat(np.arange(len(which)), count)
    at = pieces.places[np.arange(len(owner)) + (first - begin)[owner]]
    radius = radii[owner]
    half = 0.52 * count  # a little more than a half: a short arc says little of how the circle lies across, there, stay
    for _ in range(STEPS):
        off = centres[owner] - at
        distance = np.abs(off)
        towards = off / np.maximum(distance, 1e-6, out=distance)
        # Of unit vectors x + iy the squares add up to x² - y² + 2ixy, the squared lengths to their number.
        square = np.add.reduceat(towards * towards, begin) / 2
        distance -= radius
        miss = np.add.reduceat(towards * distance, begin)
        change = (half * miss - square * miss.conj()) / (half * half - (square * square.conj()).real)
        centres = centres - change
        if np.abs(change).max() < ENOUGH:
            break
    return centres
