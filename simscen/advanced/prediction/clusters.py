"""Clusters of a scan: successive hits on the same obstacle, and the cylinder that fits them.

A segment consists of successive hits that are close together. A segment of two adjacent obstacles is divided into two
clusters.
"""

import cmath
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array

MAX_GAP_M, MAX_GAP_BEAMS = 0.15, 2.5
"""Maximum distance between successive hits of a segment: in m, or as a multiple of the beam spacing."""
MAX_MISSED_BEAMS = 2
"""Maximum number of consecutive beams without a hit within a segment."""
MIN_RISE_M = 0.1
"""A segment is divided at a local maximum of the range that exceeds the minima on both sides by more than this."""
BOTH_EDGES = 2
"""Number of visible edges of a completely visible obstacle."""
SEGMENT_OFFSET_M = 1e3
"""Offset added from segment to segment, to process all segments in one array. Larger than any range."""
MAX_HALF_ANGLE_RAD = math.radians(80.0)
"""Maximum half of the angle that a cluster covers, for computing its radius, which is infinite at 90°."""
MIN_HITS = 3
"""Minimum number of hits of a cluster."""
ROUNDING_M = 1e-6
"""Tolerance for rounding errors."""
MAX_ITERATIONS, CONVERGED_STEP_M = 4, 3e-3
"""Maximum number of Gauss-Newton iterations of `fit_circle`, and the step below which they end."""

Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Points = npt.NDArray[np.complex128]
"""Points (n,) as complex numbers x + iy in m."""


@fast_dataclass(eq=False)
class Hits:
    """The m hits of a scan in order: indices of their `beams`, their `ranges`, and their `points`, each (m,).

    The maximum distance between successive hits of a segment is MAX_GAP_M or `gap_ratio` times the range, whichever is
    larger.
    """

    beams: Indices
    ranges: Array
    points: Points
    gap_ratio: float

    def may_share_segment(self, indices: list[int], count: int) -> bool:
        """Return whether one segment may contain `count` of the hits with these ascending indices.

        This is a fast check before the segments are computed. If it returns False, no segment contains so many.
        """
        linked = 1
        for one, other in pairwise(indices):
            linked = linked + 1 if self._may_link_next(one) and self._may_link_next(other - 1) else 1
            if linked == count:
                return True
        return False

    def _may_link_next(self, hit: int) -> bool:
        """Return whether the hit with this index is close enough to the next one to be in the same segment."""
        point, next_point = self.points.item(hit), self.points.item(hit + 1)
        near = min(self.ranges.item(hit), self.ranges.item(hit + 1))
        return abs(next_point - point) <= max(self.gap_ratio * near, MAX_GAP_M) + ROUNDING_M


@fast_dataclass(eq=False)
class Segments:
    """Hits divided into segments. Segment k contains the hits `first[k]` … `last[k]`."""

    hits: Hits
    first: Indices
    last: Indices

    def share_segment(self, mask: Mask, count: int) -> bool:
        """Return whether one segment contains at least `count` of the hits in the mask (m,); `count` is at least 2."""
        numbers = self.first.searchsorted(mask.nonzero()[0], side="right")
        return bool((numbers[count - 1 :] == numbers[: 1 - count]).any())


class Cluster(NamedTuple):
    """The hits `first` … `last` of a scan, and the cylinder with the same angular width and the same nearest range.

    `center` (x + iy) and `radius` of the cylinder are in m, in the lidar frame. `edges` is the number of visible ends
    (0, 1, or 2). An end is not visible if a closer obstacle or the end of the scan may hide it.
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


def find_valid_hits(ranges: Array, points: Points, step: float, min_range: float, max_range: float) -> Hits:
    """Return the hits of a scan with ranges (n,) between `min_range` and `max_range` in m.

    `points` (n,) are the endpoints of the beams; `step` is the angle between two beams in rad.
    """
    beams = ((ranges >= min_range) & (ranges <= max_range)).nonzero()[0]
    return Hits(beams, ranges[beams], points[beams], MAX_GAP_BEAMS * abs(step))


def divide_into_segments(hits: Hits) -> Segments:
    """Return the segments of the hits. The first and the last segment of a full circle are not joined."""
    beams, ranges, points = hits.beams, hits.ranges, hits.points
    gap = np.minimum(ranges[1:], ranges[:-1])
    gap *= hits.gap_ratio
    is_gap = np.abs(points[1:] - points[:-1]) > np.maximum(gap, MAX_GAP_M, out=gap)
    if len(beams) and beams[-1] - beams[0] >= len(beams):
        is_gap |= beams[1:] - beams[:-1] > MAX_MISSED_BEAMS + 1
    return Segments(hits, *_segments_between(is_gap.nonzero()[0], len(ranges)))


def find_clusters(segments: Segments, ranges: Array, start: float, step: float, max_radius: float) -> list[Cluster]:
    """Return the clusters of a scan with a radius of at most `max_radius` in m.

    `ranges` (n,) are the ranges of all beams. The first beam points along `start`; beams are `step` rad apart.
    """
    spacing = abs(step)
    hits = segments.hits
    if len(hits.beams) < MIN_HITS:
        return []
    first, last = _split_segments(hits.ranges, segments.first, segments.last)
    nearest = np.minimum.reduceat(hits.ranges, first).tolist()
    is_full_circle = abs(len(ranges) * spacing - 2 * math.pi) < spacing
    found: list[Cluster] = []
    begin, end = hits.beams.take(first).tolist(), hits.beams.take(last).tolist()
    for first_hit, last_hit, near, first_beam, last_beam in zip(first, last, nearest, begin, end, strict=True):
        if last_hit - first_hit + 1 < MIN_HITS:
            continue
        sine = math.sin(min((last_beam - first_beam + 1) * (0.5 * spacing), MAX_HALF_ANGLE_RAD))
        radius = near * sine / (1.0 - sine)
        if radius <= max_radius:
            center = cmath.rect(near + radius, start + (0.5 * step) * (first_beam + last_beam))
            edges = _has_edge(ranges, first_beam, first_beam - 1, is_full_circle) + _has_edge(
                ranges, last_beam, last_beam + 1, is_full_circle
            )
            found.append(Cluster(first_hit, last_hit, center, radius, edges))
    return found


def _has_edge(ranges: Array, beam: int, neighbor: int, is_full_circle: bool) -> bool:
    """Return whether a cluster has a visible edge at `beam`: the beam `neighbor` next to it has a longer range."""
    if not 0 <= neighbor < len(ranges):
        if not is_full_circle:
            return False
        neighbor %= len(ranges)
    return bool(ranges[neighbor] > ranges[beam])


def count_marked_hits(found: list[Cluster], mask: Mask) -> list[tuple[int, int]]:
    """Return the number of hits that are True in `mask` (m,), and the number of all hits, for each cluster."""
    marks = mask.tobytes()
    return [(marks.count(1, first, last + 1), last + 1 - first) for first, last, *_ in found]


def _segments_between(breaks: Indices, count: int) -> tuple[Indices, Indices]:
    """Return the first and the last hit of each segment of `count` hits; segments end at the hits `breaks` (k,)."""
    if not count:
        return breaks, breaks
    first, last = np.zeros(len(breaks) + 1, np.int64), np.empty(len(breaks) + 1, np.int64)
    np.add(breaks, 1, out=first[1:])
    last[:-1], last[-1] = breaks, count - 1
    return first, last


def _split_segments(ranges: Array, first: Indices, last: Indices) -> tuple[list[int], list[int]]:
    """Return the first and the last hit of each cluster, by dividing segments at local maxima of the range.

    Along one convex obstacle, the range falls to the closest point and then rises. A maximum separates two obstacles.
    """
    # All segments are processed at once. An offset that increases from segment to segment keeps them independent.
    count = last - first + 1
    steps = np.repeat(SEGMENT_OFFSET_M * np.arange(len(first)), count)
    after = ranges + steps
    after -= np.minimum.accumulate(after[::-1])[::-1]
    before = np.subtract(ranges, steps, out=steps)
    before -= np.minimum.accumulate(before)
    rise = np.maximum.reduceat(np.minimum(before, after, out=before), first)
    begin, end = first.tolist(), last.tolist()
    for number in ((rise > MIN_RISE_M) & (count >= 2 * MIN_HITS)).nonzero()[0].tolist()[::-1]:
        place = slice(number, number + 1)
        begin[place], end[place] = zip(*_split_segment(ranges, begin[number], end[number]), strict=True)
    return begin, end


def _split_segment(ranges: Array, begin: int, end: int) -> list[tuple[int, int]]:
    """Return the first and the last hit of each cluster of one segment."""
    pending = [(begin, end)]
    parts: list[tuple[int, int]] = []
    while pending:
        begin, end = pending.pop()
        if end - begin + 1 >= 2 * MIN_HITS:
            part = ranges[begin : end + 1]
            before, after = np.minimum.accumulate(part), np.minimum.accumulate(part[::-1])[::-1]
            rise = part - np.maximum(before, after)
            peak = int(rise.argmax())
            if rise[peak] > MIN_RISE_M:
                pending += [(begin + peak + 1, end), (begin, begin + peak)]
                continue
        parts.append((begin, end))
    return parts


def fit_circle(arc: list[complex], radius: float, center: complex) -> complex:
    """Return the center (x + iy) of the circle with this radius that fits the points `arc` (x + iy) best.

    `center` is the initial guess.
    """
    half = 0.52 * len(arc)  # slightly damped, because a short arc does not determine the lateral position
    for _ in range(MAX_ITERATIONS):
        squares = residual = 0j
        for point in arc:
            offset = center - point
            distance = abs(offset)
            towards = offset / max(distance, 1e-6)
            # The squares of unit vectors x + iy sum up to x² - y² + 2ixy, their squared lengths to their number.
            squares += towards * towards
            residual += towards * (distance - radius)
        square = squares / 2
        change = (half * residual - square * residual.conjugate()) / (half * half - abs(square) ** 2)
        center -= change
        if abs(change) < CONVERGED_STEP_M:
            break
    return center
