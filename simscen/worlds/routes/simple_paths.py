"""Ways between upright solids in plain numbers: enough to say at once that a goal can be reached.

What is found here is a way; where nothing is found, there may be one all the same, and `shortest` must look, with numpy
and scipy, which take longer to import than all of this.
"""

import heapq
import math
from collections.abc import Callable, Iterable
from itertools import product

from simscen.core.geometry.shapes import Solid
from simscen.worlds.geometry.overlaps import ZRange
from simscen.worlds.geometry.prisms import UprightPrism, upright_prism

Point = tuple[float, float]
Cell = tuple[int, int]

STEP = 0.2
"""Meters between the points of the search."""
HALF_STEP = STEP * math.sqrt(0.5)
"""How far a diagonal move may be from the nearer of its ends."""
SLACK = 0.02
"""Meters of clearance that looking at single points of a straight line costs."""
MOST_POINTS = 4000
"""Of a search; beyond, the library is faster."""


class SimplePaths:
    """Ways of a disc of `radius` meters between solids that stand upright over convex bases."""

    def __init__(self, prisms: Iterable[UprightPrism], radius: float) -> None:
        self._radius = radius
        self._lengths: dict[tuple[Point, Point], float] = {}
        self._near: dict[Cell, list[UprightPrism]] = {}
        reach = radius + HALF_STEP + SLACK
        for prism in prisms:
            left, low, right, high = prism.rectangle
            columns = range(math.floor(left - reach), math.floor(right + reach) + 1)
            rows = range(math.floor(low - reach), math.floor(high + reach) + 1)
            for bucket in product(columns, rows):
                self._near.setdefault(bucket, []).append(prism)

    def length(self, start: Point, goal: Point) -> float:
        """Meters of a way from start to goal, perhaps not the shortest; inf when none was found."""
        if (start, goal) not in self._lengths:
            self._lengths[start, goal] = self._length(start, goal)
        return self._lengths[start, goal]

    def _length(self, start: Point, goal: Point) -> float:
        if self._is_clear(start, goal):
            return math.dist(start, goal)

        def last_leg(here: Point) -> float:
            near = math.dist(here, goal) < 2 * STEP and self._is_clear(here, goal)
            return math.dist(here, goal) if near else math.inf

        return self._search(start, goal, last_leg)

    def comes_to(self, start: Point, towards: Point, arrived: Callable[[Point], bool]) -> bool:
        """Whether a way was found to where the disc's middle has arrived; the search looks `towards` a point first."""
        return (
            arrived(start) or self._search(start, towards, lambda here: 0.0 if arrived(here) else math.inf) < math.inf
        )

    def _search(self, start: Point, goal: Point, last_leg: Callable[[Point], float]) -> float:
        """A* over a lattice about the start until a point has a last leg."""
        driven: dict[Cell, float] = {(0, 0): 0.0}
        queue = [(math.dist(start, goal), (0, 0))]
        done: set[Cell] = set()
        while queue and len(driven) < MOST_POINTS:
            _, cell = heapq.heappop(queue)
            if cell in done:
                continue
            done.add(cell)
            here = _point(start, cell)
            if (rest := last_leg(here)) < math.inf:
                return driven[cell] + rest
            for move in MOVES:
                to = cell[0] + move[0], cell[1] + move[1]
                there, length = _point(start, to), driven[cell] + STEP * math.hypot(*move)
                if length < driven.get(to, math.inf) and self._passes(here, there, cell == (0, 0)):
                    driven[to] = length
                    heapq.heappush(queue, (length + math.dist(there, goal), to))
        return math.inf

    def _passes(self, here: Point, there: Point, first: bool) -> bool:
        """Whether the disc can move to a neighbor; the start alone may be nearer to things than the search allows."""
        return self._keeps(there, HALF_STEP) and (not first or self._is_clear(here, there))

    def _is_clear(self, a: Point, b: Point) -> bool:
        pieces = max(1, math.ceil(math.dist(a, b) / (2 * SLACK)))
        parts = (k / pieces for k in range(pieces + 1))
        return all(self._keeps((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])), SLACK) for t in parts)

    def _keeps(self, point: Point, more: float) -> bool:
        """Whether everything is at least the radius and `more` meters away."""
        near = self._near.get((math.floor(point[0]), math.floor(point[1])), ())
        return all(prism.distance(point, (prism.bottom, prism.top)) >= self._radius + more for prism in near)


MOVES = [move for move in product((-1, 0, 1), repeat=2) if move != (0, 0)]


def simple_paths_between(solids: Iterable[Solid], radius: float, z_range: ZRange) -> SimplePaths | None:
    """Ways between what stands between two heights; None where something there is not upright."""
    prisms = [upright_prism(solid) for solid in solids]
    if any(prism is None for prism in prisms):
        return None
    low, high = z_range
    return SimplePaths((prism for prism in prisms if prism and prism.bottom < high and prism.top > low), radius)


def _point(start: Point, cell: Cell) -> Point:
    return start[0] + STEP * cell[0], start[1] + STEP * cell[1]
