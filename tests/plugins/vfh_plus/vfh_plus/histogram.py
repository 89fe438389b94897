"""VFH+: from obstacles around the robot to a direction to drive in (Ulrich and Borenstein, ICRA 1998)."""

import math

import numpy as np

from simscen.plugin import Array

SECTORS = 72
WIDTH = 2 * math.pi / SECTORS
CLEAR, BLOCKED = 0.3, 0.5
"""Thresholds of the binary histogram with their hysteresis: below CLEAR a sector opens, above BLOCKED it closes."""
WIDE = 16
"""Sectors: a valley wider than this has more than one direction to choose."""
TO_TARGET, TO_HEADING, TO_LAST = 5.0, 2.0, 2.0
"""Weights of the cost of a direction; the first is larger than the sum of the others, so that the robot gets there."""


class Histogram:
    """Keeps the binary histogram and the last direction from one call to the next; angles in rad in the map frame."""

    def __init__(self) -> None:
        self._blocked = np.zeros(SECTORS, dtype=bool)
        self._last: float | None = None

    def direction(self, cells: Array, radius: float, reach: float, target: float, heading: float) -> float | None:
        """The direction to drive in; None where every one is blocked.

        `cells` (n, 2) are obstacles relative to the robot; `radius` is the robot's with its safety, and what is farther
        than `reach` does not count. `target` is where it wants to go, `heading` where it looks.
        """
        density = polar(cells, radius, reach)
        self._blocked = np.where(density > BLOCKED, True, np.where(density < CLEAR, False, self._blocked))
        last = target if self._last is None else self._last
        candidates = _candidates(self._blocked, target)
        costs = [
            TO_TARGET * _apart(c, target) + TO_HEADING * _apart(c, heading) + TO_LAST * _apart(c, last)
            for c in candidates
        ]
        self._last = candidates[int(np.argmin(costs))] if candidates else None
        return self._last


def polar(cells: Array, radius: float, reach: float) -> Array:
    """The primary polar histogram (SECTORS,): a cell counts in each sector in which the enlarged robot would hit it."""
    distance = np.hypot(*cells.T)
    near = (distance < reach) & (distance > 1e-6)
    distance, angle = distance[near], np.arctan2(cells[near, 1], cells[near, 0])
    magnitude = 1.0 - (distance / reach) ** 2
    enlarged = np.arcsin(np.minimum(radius / distance, 1.0))
    middles = (np.arange(SECTORS) + 0.5) * WIDTH
    off = np.abs((middles[:, None] - angle + math.pi) % (2 * math.pi) - math.pi)
    return np.where(off <= enlarged + WIDTH / 2, magnitude, 0.0).sum(axis=1)


def _candidates(blocked: Array, target: float) -> list[float]:
    """Directions worth a look: the middle of a narrow valley, both sides of a wide one, and the target inside one."""
    if not blocked.any():
        return [target]
    first = int(blocked.argmax())
    found: list[float] = []
    run: list[int] = []
    for k in range(first, first + SECTORS + 1):
        if not blocked[k % SECTORS]:
            run.append(k)
            continue
        if run:
            found += _of_valley(run[0], run[-1], target)
        run = []
    return found


def _of_valley(right: int, left: int, target: float) -> list[float]:
    if left - right < WIDE:
        return [((right + left) / 2 + 0.5) * WIDTH]
    ends = [(right + WIDE / 2 + 0.5) * WIDTH, (left - WIDE / 2 + 0.5) * WIDTH]
    inside = (target - ends[0]) % (2 * math.pi) <= (ends[1] - ends[0]) % (2 * math.pi)
    return [*ends, target] if inside else ends


def _apart(one: float, other: float) -> float:
    return abs(math.remainder(one - other, 2 * math.pi))
