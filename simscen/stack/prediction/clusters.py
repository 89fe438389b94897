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
STEP_APART = 1e3
"""Metres: more than any beam sees."""
FEWEST = 3
"""Hits of a piece that is looked at."""
STEPS = 4
"""Of Gauss-Newton: from half a radius off, a circle is found to a millimetre."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Clusters:
    """Pieces of a scan, in the lidar's frame.

    Piece k is the hits `first[k]` … `last[k]` of `points` (m, 2), which beam `beams` (m,) made. `centres` (n, 2) and
    `radii` (n,) are of the cylinders that fill the same angle at the same distance. `edges` (n,): at how many
    of its two ends nothing nearer stands, nor the scan ends; at both, all of it is seen.
    """

    points: Array
    beams: Indices
    first: Indices
    last: Indices
    centres: Array
    radii: Array
    edges: Indices

    @property
    def whole(self) -> npt.NDArray[np.bool_]:
        """Which (n,) are seen from edge to edge."""
        return np.asarray(self.edges == BOTH)

    @property
    def places(self) -> npt.NDArray[np.complex128]:
        """The hits (m,) as complex numbers."""
        return self.points.view(np.complex128)[:, 0]


def clusters(ranges: Array, angles: Array, least: float, most: float, largest: float, full_circle: bool) -> Clusters:
    """The pieces of a scan of beams that answer between `least` and `most` metres, none with a radius over `largest`.

    A circle's first and last piece are not joined: what lies behind the robot across the seam is two.
    """
    with np.errstate(invalid="ignore"):
        beams = np.flatnonzero((ranges >= least) & (ranges <= most))
        seen = np.where(ranges >= least, ranges, 0.0)
    r, a = ranges[beams], angles[beams]
    points = np.empty((len(r), 2))
    points[:, 0], points[:, 1] = r * np.cos(a), r * np.sin(a)
    step = abs(float(angles[1] - angles[0])) if len(angles) > 1 else 0.0
    if len(beams) < FEWEST:
        none = np.zeros(0, dtype=np.int64)
        return Clusters(points, beams, none, none, np.zeros((0, 2)), np.zeros(0), none)
    off = points[1:] - points[:-1]
    apart = np.hypot(off[:, 0], off[:, 1])
    together = (apart <= np.maximum(GAP, SPARSE * step * np.minimum(r[1:], r[:-1]))) & (
        beams[1:] - beams[:-1] <= MISSED + 1
    )
    breaks = np.flatnonzero(~together)
    first, last = _parted(r, np.concatenate(([0], breaks + 1)), np.concatenate((breaks, [len(beams) - 1])))
    long = last - first + 1 >= FEWEST
    first, last = first[long], last[long]
    half = (a[last] - a[first] + step) / 2
    nearest = np.minimum.reduceat(r, np.column_stack((first, last + 1)).ravel().clip(max=len(r) - 1))[::2]
    sine = np.sin(np.minimum(np.abs(half), math.radians(80.0)))
    radii = nearest * sine / (1.0 - sine)
    small = radii <= largest
    first, last, nearest, radii = first[small], last[small], nearest[small], radii[small]
    middle, away = (a[first] + a[last]) / 2, nearest + radii
    centres = np.column_stack((away * np.cos(middle), away * np.sin(middle)))
    edges = _clear(seen, beams[first] - 1, r[first], full_circle) + _clear(seen, beams[last] + 1, r[last], full_circle)
    return Clusters(points, beams, first, last, centres, radii, edges)


def _parted(ranges: Array, first: Indices, last: Indices) -> tuple[Indices, Indices]:
    """Pieces cut where two things that touch meet: there the range is greater than somewhere to either side.

    Along one convex thing it falls to its nearest point and then rises, whatever its shape.
    """
    # Of all pieces at once, each a step below or above the one before: so none knows of the others.
    steps = np.repeat(STEP_APART * np.arange(len(first)), last - first + 1)
    before = np.minimum.accumulate(ranges - steps) + steps
    after = np.minimum.accumulate((ranges + steps)[::-1])[::-1] - steps
    rise = np.maximum.reduceat(ranges - np.maximum(before, after), first)
    cut = (rise > VALLEY) & (last - first + 1 >= 2 * FEWEST)
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


def _clear(seen: Array, beam: Indices, edge: Array, full_circle: bool) -> Indices:
    """1 where the beam beside an edge goes on beyond it, else 0."""
    inside = (beam >= 0) & (beam < len(seen))
    return np.asarray((inside | full_circle) & (seen[beam % len(seen)] > edge), dtype=np.int64)


def fitted(pieces: Clusters, which: Indices, centres: Array, radii: Array) -> Array:
    """The centres (n, 2) of the circles of these radii (n,) that fit the arcs of `which` (n,) pieces best.

    `centres` (n, 2) are a first guess.
    """
    first, count = pieces.first[which], pieces.last[which] - pieces.first[which] + 1
    begin = np.cumsum(count) - count
    owner = np.repeat(np.arange(len(which)), count)
    at = pieces.places[np.arange(len(owner)) + (first - begin)[owner]]
    place, radius = centres[:, 0] + 1j * centres[:, 1], radii[owner]
    for _ in range(STEPS):
        off = place[owner] - at
        distance = np.maximum(np.abs(off), 1e-6)
        towards = off / distance
        # Of unit vectors x + iy the squares add up to x² - y² + 2ixy, the squared lengths to their number.
        square = np.add.reduceat(towards * towards, begin)
        # A short arc says little of how the circle lies across: there, stay.
        xx, yy, xy = (1.04 * count + square.real) / 2, (1.04 * count - square.real) / 2, square.imag / 2
        miss = np.add.reduceat(towards * (distance - radius), begin)
        across = yy * miss.real - xy * miss.imag + 1j * (xx * miss.imag - xy * miss.real)
        place = place - across / (xx * yy - xy * xy)
    return np.column_stack((place.real, place.imag))
