"""From loose segments to closed outlines."""

from itertools import pairwise

import numpy as np

from simscen.core.geometry import Array

Point = tuple[float, float]


def loops(segments: Array) -> list[list[Point]]:
    """Chains of directed segments (n, 2, 2), corner by corner without those on straight lines.

    A closed chain ends with its first corner. Segments join where one ends at exactly the point that another begins.
    """
    starting: dict[Point, list[int]] = {}
    points = [((a[0], a[1]), (b[0], b[1])) for a, b in segments.tolist()]
    for number, (start, _) in enumerate(points):
        starting.setdefault(start, []).append(number)
    ends = {end for _, end in points}
    # Open chains first, from where nothing leads to, or they would be begun in their middle.
    order = sorted(range(len(points)), key=lambda k: (points[k][0] in ends, k))
    used = [False] * len(points)
    chains = []
    for first in order:
        if used[first]:
            continue
        chain, number = [points[first][0]], first
        while not used[number]:
            used[number] = True
            chain.append(points[number][1])
            number = next((k for k in starting.get(chain[-1], ()) if not used[k]), number)
        chains.append(_corners(chain))
    return chains


def _corners(chain: list[Point]) -> list[Point]:
    """Leave out points within a micrometre of the line between their neighbours."""
    kept = chain[:1]
    for here, following in pairwise(chain[1:]):
        ax, ay = here[0] - kept[-1][0], here[1] - kept[-1][1]
        bx, by = following[0] - kept[-1][0], following[1] - kept[-1][1]
        if abs(ax * by - ay * bx) > 1e-6 * float(np.hypot(bx, by)):
            kept.append(here)
    return [*kept, chain[-1]]
