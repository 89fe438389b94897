"""Fast search for a path of a disc-shaped robot between upright solids, without NumPy and SciPy.

This search may miss a path. If it finds none, use `shortest_paths`.
"""

import heapq
import math
from collections.abc import Callable, Iterable
from itertools import product

from simscen.core.geometry.shapes import Solid
from simscen.worlds.geometry.overlaps import ZRange
from simscen.worlds.geometry.prisms import UprightPrism, upright_prism

Point = tuple[float, float]
"""(x, y) in m."""
Cell = tuple[int, int]
"""Point of the search grid: steps along x and y from the start."""
Bucket = tuple[int, int]
"""Lower left corner in m of a square of 1 x 1 m, for which the prisms nearby are listed."""

STEP_M = 0.2
"""Distance between neighboring points of the search grid, along x and y."""
HALF_DIAGONAL_STEP_M = STEP_M * math.sqrt(0.5)
"""Half of the length of a diagonal move. Each point of a move is at most this far from one end of the move."""
SAMPLING_MARGIN_M = 0.02
"""Additional clearance, because straight lines are checked only at single points."""
MAX_GRID_POINTS = 4000
"""Maximum number of grid points that a search may discover."""
MOVES = [move for move in product((-1, 0, 1), repeat=2) if move != (0, 0)]
"""Steps to the eight neighbors of a grid point."""


class SimplePaths:
    """Finds paths of a disc of `radius` m around upright prisms with convex bases. Heights are ignored."""

    def __init__(self, prisms: Iterable[UprightPrism], radius: float) -> None:
        self._radius = radius
        self._lengths: dict[tuple[Point, Point], float] = {}
        self._prisms_near: dict[Bucket, list[UprightPrism]] = {}
        search_radius = radius + HALF_DIAGONAL_STEP_M + SAMPLING_MARGIN_M
        for prism in prisms:
            left, bottom, right, top = prism.rectangle
            columns = range(math.floor(left - search_radius), math.floor(right + search_radius) + 1)
            rows = range(math.floor(bottom - search_radius), math.floor(top + search_radius) + 1)
            for bucket in product(columns, rows):
                self._prisms_near.setdefault(bucket, []).append(prism)

    def length(self, start: Point, goal: Point) -> float:
        """Return the length in m of a path, not necessarily the shortest one, to the goal; inf if none was found."""

        def last_leg(here: Point) -> float:
            near = math.dist(here, goal) < 2 * STEP_M and self._is_clear(here, goal)
            return math.dist(here, goal) if near else math.inf

        if (start, goal) not in self._lengths:
            is_direct = self._is_clear(start, goal)
            self._lengths[start, goal] = math.dist(start, goal) if is_direct else self._search(start, goal, last_leg)
        return self._lengths[start, goal]

    def can_enter(self, start: Point, towards: Point, is_inside: Callable[[Point], bool]) -> bool:
        """Return whether a path was found from `start` to any point for which `is_inside` is true.

        The search examines points near `towards` first.
        """
        return (
            is_inside(start)
            or self._search(start, towards, lambda here: 0.0 if is_inside(here) else math.inf) < math.inf
        )

    def _search(self, start: Point, goal: Point, last_leg: Callable[[Point], float]) -> float:
        """Return the length in m of a path by A* over a grid around the start; inf if none was found.

        `last_leg` returns the length in m of the path from a grid point to the end; inf if the search must continue.
        """
        lengths: dict[Cell, float] = {(0, 0): 0.0}
        queue = [(math.dist(start, goal), (0, 0))]
        visited: set[Cell] = set()
        while queue and len(lengths) < MAX_GRID_POINTS:
            _, cell = heapq.heappop(queue)
            if cell in visited:
                continue
            visited.add(cell)
            here = _point(start, cell)
            if (remaining := last_leg(here)) < math.inf:
                return lengths[cell] + remaining
            for move in MOVES:
                neighbor = cell[0] + move[0], cell[1] + move[1]
                there, length = _point(start, neighbor), lengths[cell] + STEP_M * math.hypot(*move)
                if length >= lengths.get(neighbor, math.inf) or not self._has_clearance(there, HALF_DIAGONAL_STEP_M):
                    continue
                # Every grid point except the start has so much clearance that the lines to its neighbors are clear.
                if cell != (0, 0) or self._is_clear(here, there):
                    lengths[neighbor] = length
                    heapq.heappush(queue, (length + math.dist(there, goal), neighbor))
        return math.inf

    def _is_clear(self, a: Point, b: Point) -> bool:
        """Return whether the disc can move from `a` to `b` in a straight line."""
        pieces = max(1, math.ceil(math.dist(a, b) / (2 * SAMPLING_MARGIN_M)))
        parts = (k / pieces for k in range(pieces + 1))
        return all(
            self._has_clearance((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])), SAMPLING_MARGIN_M) for t in parts
        )

    def _has_clearance(self, point: Point, margin: float) -> bool:
        """Return whether all prisms are at least the radius plus `margin` m away."""
        near = self._prisms_near.get((math.floor(point[0]), math.floor(point[1])), ())
        return all(prism.distance(point, (prism.bottom, prism.top)) >= self._radius + margin for prism in near)


def simple_paths_between(solids: Iterable[Solid], radius: float, z_range: ZRange) -> SimplePaths | None:
    """Prepare the search for paths of a disc of `radius` m around the parts of solids between two heights.

    Returns None if one of the solids is not an upright prism with a convex base.
    """
    prisms = [upright_prism(solid) for solid in solids]
    if any(prism is None for prism in prisms):
        return None
    low, high = z_range
    return SimplePaths((prism for prism in prisms if prism and prism.bottom < high and prism.top > low), radius)


def _point(start: Point, cell: Cell) -> Point:
    """Return the position of a point of the search grid."""
    return start[0] + STEP_M * cell[0], start[1] + STEP_M * cell[1]
