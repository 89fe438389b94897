"""The shortest way of a disc through the static world: what a driven path is measured against."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.navigation import Goal
from simscen.core.records.case import Passage
from simscen.grid_graph import CellIndices, GridGraph
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.routes.clearance import HALF_DIAGONAL, clearance_field
from simscen.worlds.routes.narrow_gaps import narrowest_gap_in
from simscen.worlds.routes.passages import passage_of, passages
from simscen.worlds.routes.path_tightening import is_clear, length, tighten

Z_RANGE = (0.03, 0.4)
"""What a robot may touch: above thresholds it rolls over, below what it passes under."""
FINEST = 0.05
"""m; the cells of the search."""
MOST_CELLS = 1_000_000
"""Of the search; larger worlds are searched more coarsely."""


@dataclass(frozen=True)
class Leg:
    """A shortest way to a goal: meters, inf where there is none, and what it passes between."""

    length: float
    passages: tuple[Passage, ...] = ()


class ShortestPaths:
    """Shortest ways for a disc of one radius in one world.

    Lengths are within about 1 % of the truth; where two sides of an obstacle differ by less than 3 %, the longer one
    may be taken. The smallest radius is 0.7 cells of the search, which are 5 cm in worlds of up to 50 x 50 m. A house
    of 20 x 20 m takes some 30 ms to prepare and 30 ms for each way around corners.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        bounds: tuple[float, float, float, float],
        radius: float,
        z_range: tuple[float, float] = Z_RANGE,
        finest: float = FINEST,
    ) -> None:
        """Searched in cells of `finest` meters, or larger ones in a large world."""
        x0, y0, x1, y1 = bounds
        room = 2 * radius  # all around the world, so that a way may lead around it
        bounds = (x0 - room, y0 - room, x1 + room, y1 + room)
        resolution = max(finest, math.sqrt((x1 - x0 + 2 * room + 2) * (y1 - y0 + 2 * room + 2) / MOST_CELLS))
        grid = empty_grid(bounds, resolution, "shortest way")
        self._radius = max(radius, 0.71 * resolution)
        self._too_small = radius < self._radius
        self._field = clearance_field(mesh, grid, z_range)
        self._allowed = self._radius - 0.1 * resolution

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Meters of the shortest way between two positions; inf if there is none or the disc does not fit there."""
        way = self.way(start, goal)
        return math.inf if way is None else length(way)

    def leg(self, start: Pose2, goal: Pose2, name: str) -> Leg:
        """The shortest way to the goal called `name`; where there is none, the gap that is too narrow."""
        way = self.way(start, goal)
        if way is not None:
            return Leg(length(way), passages(way, name, self._field))
        return Leg(math.inf, self._too_narrow(start, goal, name))

    def _too_narrow(self, start: Pose2, goal: Pose2, name: str) -> tuple[Passage, ...]:
        """Nothing where an end itself is in the way of something, or where there is no gap at all."""
        if not self._field.keeps(np.array([start[:2], goal[:2]]), self._allowed).all():
            return ()
        gap = narrowest_gap_in(self._field, (start, goal), self._radius)
        return (passage_of(gap.sides, name, self._field),) if len(gap.sides) == 2 else ()

    def way(self, start: Pose2, goal: Pose2) -> Array | None:
        """The corners (n, 2) of the shortest way, arcs as short chords; None if there is none."""
        ends = np.array([start[:2], goal[:2]])
        if not self._field.keeps(ends, self._allowed).all():
            return None
        if is_clear(ends[0], ends[1], self._field, self._allowed):
            return ends
        bold = self._over(self._bold_lattice, ends)
        if bold is None or self._is_clear(bold):
            return bold
        return self._over(self._strict_lattice, ends)

    def may_reach(self, start: Pose2, goal: Pose2) -> bool:
        """Whether a way may lead from one position to the other; False is a proof that there is none for the disc."""
        if self._too_small:
            return True
        first, last = (self._free_cell(self._bold_lattice, np.array(end[:2])) for end in (start, goal))
        return not first or not last or self._bold_lattice.way(first, last) is not None

    def may_come_to(self, starts: Sequence[Pose2], arrived: Callable[[Pose2], float]) -> bool:
        """Whether the disc's middle may get from one of the starts to where `arrived` (a distance) is 0.

        False is a proof that it may not.
        """
        if self._too_small:
            return True
        grid = self._field.grid
        cells = self._bold_lattice.joined(
            [self._free_cell(self._bold_lattice, np.array(start[:2])) for start in starts]
        )
        slack = HALF_DIAGONAL * grid.resolution
        return any(arrived(Pose2(x, y)) <= slack for x, y in grid.center_of(cells).tolist())

    @cached_property
    def _bold_lattice(self) -> GridGraph:
        """Every cell that the disc may pass, if not over its middle: no gap is missed, some are too narrow."""
        return GridGraph(self._field.free_cells(self._radius - HALF_DIAGONAL * self._field.grid.resolution))

    @cached_property
    def _strict_lattice(self) -> GridGraph:
        """The cells over whose middle the disc may pass: gaps less than a cell wider than the disc may be missed."""
        return GridGraph(self._field.free_cells(self._radius))

    def _over(self, lattice: GridGraph, ends: Array) -> Array | None:
        first, last = (self._free_cell(lattice, end) for end in ends)
        cells = lattice.way(first, last) if first and last else None
        if cells is None:
            return None
        inner = self._field.grid.center_of(cells)
        return tighten(np.concatenate((ends[:1], inner, ends[1:])), self._field, self._radius)

    def _is_clear(self, way: Array) -> bool:
        return all(is_clear(a, b, self._field, self._allowed) for a, b in pairwise(way))

    def _free_cell(self, lattice: GridGraph, point: Array) -> tuple[int, int] | None:
        """The free cell nearest to a point, which may itself lie in a cell whose middle is too near a wall."""
        grid = self._field.grid
        around = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3), indexing="ij"), axis=-1).reshape(-1, 2)
        cells: CellIndices = grid.cell_of(point[None]) + around
        cells = cells[grid.inside(cells)]
        cells = cells[lattice.is_free(cells)]
        if not len(cells):
            return None
        row, column = cells[np.argmin(np.linalg.norm(grid.center_of(cells) - point, axis=1))].tolist()
        return row, column


def ways_in(
    built: BuiltWorld,
    stops: Sequence[Pose2],
    radius: float,
    z_range: tuple[float, float] = Z_RANGE,
    finest: float = FINEST,
) -> ShortestPaths:
    """The shortest ways of a disc in a built world, wherever the stops are."""
    return ShortestPaths(built.mesh, _around(built, stops), radius, z_range, finest)


def legs_between(
    built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float, z_range: tuple[float, float] = Z_RANGE
) -> list[Leg]:
    """The shortest way of a disc from each pose to its goal; the same way is looked for once."""
    stops = [pose for start, goal in ends for pose in (start, goal.pose)]
    ways = ways_in(built, stops, radius, z_range) if stops else None
    found: dict[tuple[Pose2, Pose2], Leg] = {}
    legs = []
    for start, goal in ends:
        assert ways is not None
        leg = found.get((start, goal.pose))
        found[start, goal.pose] = leg = leg or ways.leg(start, goal.pose, goal.name)
        legs.append(replace(leg, passages=tuple(replace(each, goal=goal.name) for each in leg.passages)))
    return legs


def _around(built: BuiltWorld, stops: Sequence[Pose2]) -> tuple[float, float, float, float]:
    """The world's bounds, or where it states none those of its map, widened to hold the stops."""
    x0, y0, x1, y1 = built.world.bounds
    corners = [(x0, y0), (x1, y1)]
    if not any(built.world.bounds):
        height, width = (cells * built.map.resolution for cells in built.map.shape)
        corners = built.map.origin.apply(np.array([[0, 0], [width, 0], [0, height], [width, height]])).tolist()
    points = np.array([*corners, *(stop[:2] for stop in stops)])
    (left, low), (right, high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return left, low, right, high
