"""A scan in pieces: runs of neighboring beams that hit the same thing, and the cylinder that would look like that."""

import cmath
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array

GAP, SPARSE = 0.15, 2.5
"""Two hits belong together when they are no farther apart than this many meters, or times the spacing of beams."""
MISSED = 2
"""Beams that may miss within a piece."""
VALLEY = 0.1
"""Meters by which the range must rise between two things that touch, as the scan sees them."""
BOTH = 2
"""Edges of what is seen whole."""
STEP_APART = 1e3
"""Meters: more than any beam sees."""
STEEPEST = math.radians(80.0)
"""Half the angle that a piece fills at most, as far as its radius is concerned."""
FEWEST = 3
"""Hits of a piece that is looked at."""
ROUNDING = 1e-6
"""Meters."""
STEPS, ENOUGH = 4, 3e-3
"""Of Gauss-Newton: from half a radius off, a circle is found to a millimeter; meters of a step that is the last."""

Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.complex128]
"""Points (n,) as complex numbers, x + iy: to turn them is one multiplication."""


@fast_dataclass(eq=False)
class Hits:
    """What the `beams` of a scan hit, in order: `ranges` and `places` (m,).

    Of two that follow each other one may be `sparse` times its range away from the other, to belong to it.
    """

    beams: Indices
    ranges: Array
    places: Places
    sparse: float

    def may_be_together(self, which: list[int], few: int) -> bool:
        """Whether so many of these hits in a row may be in one run: none is parted from those beside it."""
        row = 1
        for one, other in pairwise(which):
            row = row + 1 if self._linked(one) and self._linked(other - 1) else 1
            if row == few:
                return True
        return False

    def _linked(self, hit: int) -> bool:
        """Whether the next hit belongs to this one, as to be told without arrays; in doubt it does."""
        here, there = self.places.item(hit), self.places.item(hit + 1)
        near = min(self.ranges.item(hit), self.ranges.item(hit + 1))
        return abs(there - here) <= max(self.sparse * near, GAP) + ROUNDING


@fast_dataclass(eq=False)
class Runs:
    """Hits of which neighbors that are not far apart make a run: things that stand apart.

    A run is the hits `first[k]` … `last[k]`.
    """

    hits: Hits
    first: Indices
    last: Indices

    def together(self, which: Mask, few: int) -> bool:
        """Whether at least so many, more than one, of these hits (m,) are in one run."""
        runs = self.first.searchsorted(which.nonzero()[0], side="right")
        return bool((runs[few - 1 :] == runs[: 1 - few]).any())


class Piece(NamedTuple):
    """A piece of a scan, in the lidar's frame: the hits `first` … `last`.

    `center` (x + iy) and `radius` in m are of the cylinder that fills the same angle at the same distance. `edges`: at
    how many of its two ends nothing nearer stands, nor the scan ends; at BOTH, all of it is seen.
    """

    first: int
    last: int
    center: complex
    radius: float
    edges: int

    @property
    def hits(self) -> int:
        """How many these are."""
        return self.last - self.first + 1


def answers(ranges: Array, places: Places, step: float, least: float, most: float) -> Hits:
    """The hits of a scan of beams that answer between `least` and `most` meters, each `step` rad further.

    `places` (n,) are what they hit.
    """
    beams = ((ranges >= least) & (ranges <= most)).nonzero()[0]
    return Hits(beams, ranges[beams], places[beams], SPARSE * abs(step))


def runs(hits: Hits) -> Runs:
    """The runs of hits.

    A circle's first and last run are not joined: what lies behind the robot across the seam is two.
    """
    beams, ranges, places = hits.beams, hits.ranges, hits.places
    gap = np.minimum(ranges[1:], ranges[:-1])
    gap *= hits.sparse
    apart = np.abs(places[1:] - places[:-1]) > np.maximum(gap, GAP, out=gap)
    if len(beams) and beams[-1] - beams[0] >= len(beams):
        apart |= beams[1:] - beams[:-1] > MISSED + 1
    return Runs(hits, *_between(apart.nonzero()[0], len(ranges)))


def clusters(found: Runs, scanned: Array, start: float, step: float, largest: float) -> list[Piece]:
    """The pieces of a scan of ranges `scanned` in which these runs were found, none with a radius over `largest`.

    The first beam goes along `start`, the next `step` rad further.
    """
    wide = abs(step)
    hits = found.hits
    if len(hits.beams) < FEWEST:
        return []
    first, last = _parted(hits.ranges, found.first, found.last)
    nearest = np.minimum.reduceat(hits.ranges, first).tolist()
    full = abs(len(scanned) * wide - 2 * math.pi) < wide
    pieces: list[Piece] = []
    begin, end = hits.beams.take(first).tolist(), hits.beams.take(last).tolist()
    for one, other, near, low, high in zip(first, last, nearest, begin, end, strict=True):
        if other - one + 1 < FEWEST:
            continue
        sine = math.sin(min((high - low + 1) * (0.5 * wide), STEEPEST))
        radius = near * sine / (1.0 - sine)
        if radius <= largest:
            center = cmath.rect(near + radius, start + (0.5 * step) * (low + high))
            edges = _clear(scanned, low, low - 1, full) + _clear(scanned, high, high + 1, full)
            pieces.append(Piece(one, other, center, radius, edges))
    return pieces


def _clear(ranges: Array, beam: int, beside: int, full_circle: bool) -> bool:
    """Whether the beam beside another goes on beyond it."""
    if not 0 <= beside < len(ranges):
        if not full_circle:
            return False
        beside %= len(ranges)
    return bool(ranges[beside] > ranges[beam])


def shares(pieces: list[Piece], which: Mask) -> list[tuple[int, int]]:
    """How many of each piece's hits these are, of all (m,), and how many it has."""
    told = which.tobytes()
    return [(told.count(1, first, last + 1), last + 1 - first) for first, last, *_ in pieces]


def _between(breaks: Indices, count: int) -> tuple[Indices, Indices]:
    """First and last of so many hits in a row that is parted after these (k,)."""
    if not count:
        return breaks, breaks
    first, last = np.zeros(len(breaks) + 1, np.int64), np.empty(len(breaks) + 1, np.int64)
    np.add(breaks, 1, out=first[1:])
    last[:-1], last[-1] = breaks, count - 1
    return first, last


def _parted(ranges: Array, first: Indices, last: Indices) -> tuple[list[int], list[int]]:
    """First and last hits of pieces, cut where two things that touch meet: there the range is greater than somewhere to
    either side.

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
    begin, end = first.tolist(), last.tolist()
    for number in ((rise > VALLEY) & (count >= 2 * FEWEST)).nonzero()[0].tolist()[::-1]:
        cut = slice(number, number + 1)
        begin[cut], end[cut] = zip(*_parts(ranges, begin[number], end[number]), strict=True)
    return begin, end


def _parts(ranges: Array, begin: int, end: int) -> list[tuple[int, int]]:
    """Those of one run, in order."""
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


def fitted(arc: list[complex], radius: float, center: complex) -> complex:
    """The center of the circle of this radius that fits an arc, points x + iy, best; `center` is a first guess.

    In floats: a dozen points are too few for arrays.
    """
    half = 0.52 * len(arc)  # a little more: a short arc says little of how the circle lies across; there, stay
    for _ in range(STEPS):
        squares = miss = 0j
        for place in arc:
            off = center - place
            distance = abs(off)
            towards = off / max(distance, 1e-6)
            # Of unit vectors x + iy the squares add up to x² - y² + 2ixy, the squared lengths to their number.
            squares += towards * towards
            miss += towards * (distance - radius)
        square = squares / 2
        change = (half * miss - square * miss.conjugate()) / (half * half - abs(square) ** 2)
        center -= change
        if abs(change) < ENOUGH:
            break
    return center
