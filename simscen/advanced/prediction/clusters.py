"""Clusters of a scan: successive hits on the same obstacle, and the cylinder that fits them.

A segment consists of successive hits that are close together. A segment of two adjacent obstacles is divided into two
clusters.
"""

import cmath
import math
from collections.abc import Iterator
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
MAX_HALF_ANGLE_RAD = math.radians(80.0)
"""Maximum half of the angle that a cluster covers, for computing its radius, which is infinite at 90°."""
MIN_HITS = 3
"""Minimum number of hits of a cluster."""
MAX_ITERATIONS, CONVERGED_STEP_M = 4, 3e-3
"""Maximum number of Gauss-Newton iterations of `fit_circle`, and the step below which the iterations end."""

Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Points = npt.NDArray[np.complex128]
"""Points (n,) as complex numbers x + iy in m."""


@fast_dataclass(eq=False)
class Segments:
    """The m hits of a scan, divided into segments. Segment k contains the hits `first[k]` … `last[k]`.

    The hits are in order, with the indices of their `beams`, their `ranges`, and their `points`, each (m,).
    """

    beams: Indices
    ranges: Array
    points: Points
    first: Indices
    last: Indices

    def has_segment_with(self, count: int, mask: Mask) -> bool:
        """Return whether any segment contains at least `count` of the hits in the mask (m,); `count` is at least 2."""
        numbers = self.first.searchsorted(mask.nonzero()[0], side="right")
        return bool((numbers[count - 1 :] == numbers[: 1 - count]).any())


class Cluster(NamedTuple):
    """The hits `first` … `last` of a scan, and the cylinder with the same angular width and the same nearest range.

    `center` (x + iy) and `radius` of the cylinder are in m, in the lidar frame. `edges` is the number of visible ends
    (0, 1, or 2). An end is not visible if a closer obstacle or the end of the scan may hide it. `appeared` states
    whether the cluster is in formerly free space, and `was_occupied` whether an earlier scan hit something there.
    """

    first: int
    last: int
    center: complex
    radius: float
    edges: int
    appeared: bool = False
    was_occupied: bool = False

    @property
    def is_fully_visible(self) -> bool:
        """Whether both ends are visible."""
        return self.edges == BOTH_EDGES

    @property
    def is_static(self) -> bool:
        """Whether an earlier scan saw the same obstacle at this position."""
        return self.was_occupied and not self.appeared


def find_segments(ranges: Array, points: Points, step: float, min_range: float, max_range: float) -> Segments:
    """Return the segments of the hits of a scan with ranges (n,) between `min_range` and `max_range` in m.

    `points` (n,) are the endpoints of the beams; `step` is the angle between two beams in rad. The first and the last
    segment of a full circle are not joined.
    """
    beams = ((ranges >= min_range) & (ranges <= max_range)).nonzero()[0]
    ranges, points = ranges[beams], points[beams]
    gap = np.minimum(ranges[1:], ranges[:-1])
    gap *= MAX_GAP_BEAMS * abs(step)
    is_gap = np.abs(points[1:] - points[:-1]) > np.maximum(gap, MAX_GAP_M, out=gap)
    is_gap |= beams[1:] - beams[:-1] > MAX_MISSED_BEAMS + 1
    is_first = np.ones(len(beams), dtype=np.bool_)
    is_first[1:] = is_gap
    first = is_first.nonzero()[0]
    return Segments(beams, ranges, points, first, np.append(first, len(beams))[1:] - 1)


def find_clusters(segments: Segments, ranges: Array, start: float, step: float, max_radius: float) -> list[Cluster]:
    """Return the clusters of a scan with a radius of at most `max_radius` in m.

    `ranges` (n,) are the ranges of all beams. The first beam points along `start` in rad; beams are `step` rad apart.
    """
    spacing = abs(step)
    is_full_circle = abs(len(ranges) * spacing - 2 * math.pi) < spacing
    found: list[Cluster] = []
    for first, last in _split_segments(segments):
        first_beam, last_beam = segments.beams.item(first), segments.beams.item(last)
        nearest = segments.ranges[first : last + 1].min().item()
        sine = math.sin(min((last_beam - first_beam + 1) * (0.5 * spacing), MAX_HALF_ANGLE_RAD))
        radius = nearest * sine / (1.0 - sine)
        if radius <= max_radius:
            center = cmath.rect(nearest + radius, start + (0.5 * step) * (first_beam + last_beam))
            edges = _has_edge(ranges, first_beam, first_beam - 1, is_full_circle) + _has_edge(
                ranges, last_beam, last_beam + 1, is_full_circle
            )
            found.append(Cluster(first, last, center, radius, edges))
    return found


def _has_edge(ranges: Array, beam: int, neighbor: int, is_full_circle: bool) -> bool:
    """Return whether a cluster has a visible edge at `beam`: the beam `neighbor` next to it has a longer range."""
    if not 0 <= neighbor < len(ranges):
        if not is_full_circle:
            return False
        neighbor %= len(ranges)
    return bool(ranges[neighbor] > ranges[beam])


def _split_segments(segments: Segments) -> Iterator[tuple[int, int]]:
    """Yield the first and the last hit of each cluster with at least MIN_HITS, by dividing segments at local maxima.

    Along one convex obstacle, the range falls to the closest point and then rises. A maximum separates two obstacles.
    """
    pending = list(zip(segments.first.tolist(), segments.last.tolist(), strict=True))[::-1]
    while pending:
        first, last = pending.pop()
        if last - first + 1 >= 2 * MIN_HITS:
            part = segments.ranges[first : last + 1]
            before, after = np.minimum.accumulate(part), np.minimum.accumulate(part[::-1])[::-1]
            rise = part - np.maximum(before, after)
            peak = int(rise.argmax())
            if rise[peak] > MIN_RISE_M:
                pending += [(first + peak + 1, last), (first, first + peak)]
                continue
        if last - first + 1 >= MIN_HITS:
            yield first, last


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
            direction = offset / max(distance, 1e-6)
            # The squares of unit vectors x + iy sum up to x² - y² + 2ixy, their squared lengths to their number.
            squares += direction * direction
            residual += direction * (distance - radius)
        square = squares / 2
        change = (half * residual - square * residual.conjugate()) / (half * half - abs(square) ** 2)
        center -= change
        if abs(change) < CONVERGED_STEP_M:
            break
    return center
