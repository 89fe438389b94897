"""Shortest paths of a disc through the static world, as a reference for driven paths."""

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
from simscen.grid_graph import CellIndices, GridGraph, polyline_length, resample_polyline
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.routes.clearance import HALF_DIAGONAL_CELLS, ClearanceField, clearance_field
from simscen.worlds.routes.narrow_gaps import narrowest_gap_in
from simscen.worlds.routes.passages import find_passages, passage_between

Z_RANGE_M = (0.03, 0.4)
"""Heights in m between which solids block a robot: lower ones are sills to drive over, higher ones leave room below."""
MIN_RESOLUTION_M = 0.05
"""Size of the grid cells of the search."""
MAX_CELLS = 1_000_000
"""Maximum number of cells; the cells of larger worlds are larger."""


@dataclass(frozen=True)
class Leg:
    """Shortest path to a goal: its length in m, inf if there is none, and its passages."""

    length: float
    passages: tuple[Passage, ...] = ()


class ShortestPaths:
    """Shortest paths of a disc of one radius in one world.

    Lengths are exact to about 1 %. If the paths around both sides of an obstacle differ by less than 3 %, the longer
    one may be chosen. A smaller radius than 0.7 grid cells counts as 0.7 cells; a cell is 5 cm wide in worlds of up to
    50 x 50 m. A house of 20 x 20 m takes about 30 ms to prepare, and each path around corners 30 ms.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        bounds: tuple[float, float, float, float],
        radius: float,
        z_range: tuple[float, float] = Z_RANGE_M,
        min_resolution: float = MIN_RESOLUTION_M,
    ) -> None:
        """Prepare the search with cells of `min_resolution` m, or larger ones in a large world."""
        x0, y0, x1, y1 = bounds
        margin = 2 * radius  # around the world, so that a path can lead around it
        bounds = (x0 - margin, y0 - margin, x1 + margin, y1 + margin)
        resolution = max(min_resolution, math.sqrt((x1 - x0 + 2 * margin + 2) * (y1 - y0 + 2 * margin + 2) / MAX_CELLS))
        grid = empty_grid(bounds, resolution, "shortest path")
        self._radius = max(radius, 0.71 * resolution)
        self._is_radius_enlarged = radius < self._radius
        self._field = clearance_field(mesh, grid, z_range)
        self._min_clearance = self._radius - 0.1 * resolution

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Return the length in m of the shortest path between two positions; inf if there is none."""
        path = self.path(start, goal)
        return math.inf if path is None else polyline_length(path)

    def clearances(self, points: Array) -> Array:
        """Return the distances (n,) in m from points (n, 2) to the nearest solid; negative inside of solids."""
        return self._field.exact(points)

    def leg(self, start: Pose2, goal: Pose2, name: str) -> Leg:
        """Return the shortest path to the goal `name`, with its passages.

        If there is no path, the length is inf, and the only passage is the gap that is too narrow for the disc.
        """
        path = self.path(start, goal)
        if path is not None:
            return Leg(polyline_length(path), find_passages(path, name, self._field))
        return Leg(math.inf, self._too_narrow_gap(start, goal, name))

    def _too_narrow_gap(self, start: Pose2, goal: Pose2, name: str) -> tuple[Passage, ...]:
        """Return the gap that is too narrow, as one passage; empty if start or goal is occupied, or without a gap."""
        if not self._field.has_clearance(np.array([start[:2], goal[:2]]), self._min_clearance).all():
            return ()
        gap = narrowest_gap_in(self._field, (start, goal), self._radius)
        return (passage_between(gap.sides, name, self._field),) if len(gap.sides) == 2 else ()

    def path(self, start: Pose2, goal: Pose2) -> Array | None:
        """Return the corners (n, 2) of the shortest path, with arcs as short chords; None if there is none."""
        ends = np.array([start[:2], goal[:2]])
        if not self._field.has_clearance(ends, self._min_clearance).all():
            return None
        if is_line_clear(ends[0], ends[1], self._field, self._min_clearance):
            return ends
        optimistic = self._search(self._optimistic_graph, ends)
        if optimistic is None or self._is_clear(optimistic):
            return optimistic
        return self._search(self._strict_graph, ends)

    def may_reach(self, start: Pose2, goal: Pose2) -> bool:
        """Return whether there may be a path between two positions; False proves that there is none."""
        if self._is_radius_enlarged:
            return True
        first, last = (self._free_cell(self._optimistic_graph, np.array(end[:2])) for end in (start, goal))
        return not first or not last or self._optimistic_graph.shortest_path(first, last) is not None

    def may_enter(self, starts: Sequence[Pose2], distance: Callable[[Pose2], float]) -> bool:
        """Return whether the disc may get from one of the starts to a pose at which `distance` is at most 0.

        `distance` returns the distance in m from a pose to the destination. False proves that there is no path.
        """
        if self._is_radius_enlarged:
            return True
        grid = self._field.grid
        cells = self._optimistic_graph.connected_cells(
            [self._free_cell(self._optimistic_graph, np.array(start[:2])) for start in starts]
        )
        slack = HALF_DIAGONAL_CELLS * grid.resolution
        return any(distance(Pose2(x, y)) <= slack for x, y in grid.center_of(cells).tolist())

    @cached_property
    def _optimistic_graph(self) -> GridGraph:
        """All cells that the disc may touch with its center: no gap is missed, but some are too narrow."""
        return GridGraph(self._field.free_cells(self._radius - HALF_DIAGONAL_CELLS * self._field.grid.resolution))

    @cached_property
    def _strict_graph(self) -> GridGraph:
        """The cells whose center the disc may occupy: gaps less than a cell wider than the disc may be missed."""
        return GridGraph(self._field.free_cells(self._radius))

    def _search(self, graph: GridGraph, ends: Array) -> Array | None:
        """Return the tightened path (n, 2) over a graph; None if there is none."""
        first, last = (self._free_cell(graph, end) for end in ends)
        cells = graph.shortest_path(first, last) if first and last else None
        if cells is None:
            return None
        inner = self._field.grid.center_of(cells)
        return tighten_path(np.concatenate((ends[:1], inner, ends[1:])), self._field, self._radius)

    def _is_clear(self, path: Array) -> bool:
        return all(is_line_clear(a, b, self._field, self._min_clearance) for a, b in pairwise(path))

    def _free_cell(self, graph: GridGraph, point: Array) -> tuple[int, int] | None:
        """Return the free cell nearest to a point; None without one nearby. The cell of the point may not be free."""
        grid = self._field.grid
        around = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3), indexing="ij"), axis=-1).reshape(-1, 2)
        cells: CellIndices = grid.cell_of(point[None]) + around
        cells = cells[grid.inside(cells)]
        cells = cells[graph.is_free(cells)]
        if not len(cells):
            return None
        row, column = cells[np.argmin(np.linalg.norm(grid.center_of(cells) - point, axis=1))].tolist()
        return row, column


def shortest_paths_in(
    built: BuiltWorld,
    stops: Sequence[Pose2],
    radius: float,
    z_range: tuple[float, float] = Z_RANGE_M,
    min_resolution: float = MIN_RESOLUTION_M,
) -> ShortestPaths:
    """Return the shortest paths of a disc in a built world, extended to contain all `stops`."""
    return ShortestPaths(built.mesh, _bounds_containing(built, stops), radius, z_range, min_resolution)


def legs_between(
    built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float, z_range: tuple[float, float] = Z_RANGE_M
) -> list[Leg]:
    """Return the shortest path of a disc from each pose to its goal. Repeated pairs are searched once."""
    stops = [pose for start, goal in ends for pose in (start, goal.pose)]
    paths = shortest_paths_in(built, stops, radius, z_range) if stops else None
    found: dict[tuple[Pose2, Pose2], Leg] = {}
    legs = []
    for start, goal in ends:
        assert paths is not None
        leg = found.get((start, goal.pose))
        found[start, goal.pose] = leg = leg or paths.leg(start, goal.pose, goal.name)
        legs.append(replace(leg, passages=tuple(replace(each, goal=goal.name) for each in leg.passages)))
    return legs


def _bounds_containing(built: BuiltWorld, stops: Sequence[Pose2]) -> tuple[float, float, float, float]:
    """Return the bounds of the world, or of its map if the world has none, extended to contain the stops."""
    x0, y0, x1, y1 = built.world.bounds
    corners = [(x0, y0), (x1, y1)]
    if not any(built.world.bounds):
        height, width = (cells * built.map.resolution for cells in built.map.shape)
        corners = built.map.origin.apply(np.array([[0, 0], [width, 0], [0, height], [width, height]])).tolist()
    points = np.array([*corners, *(stop[:2] for stop in stops)])
    (left, low), (right, high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return left, low, right, high


MIN_SHORTENING = 0.001
"""Fraction of the length; a round that shortens the path by less is the last. Most paths need two to five rounds."""
MAX_ROUNDS = 12
SMOOTHING_STEPS = 24
"""Smoothing steps in each round; they affect about five points on either side of a corner."""


def tighten_path(path: Array, field: ClearanceField, radius: float) -> Array:
    """Return a path (n, 2) shortened as far as the clearance `radius` in m allows, with a tolerance of 0.1 cells.

    String pulling creates the straight parts. Between them, an elastic band (Quinlan and Khatib 1993) moves the path
    onto arcs with `radius` around obstacles.
    """
    min_clearance = radius - 0.1 * field.grid.resolution
    for _ in range(MAX_ROUNDS):
        before = polyline_length(path)
        path = _smooth(resample_polyline(_straighten(path, field, min_clearance), field.grid.resolution), field, radius)
        if polyline_length(path) > (1 - MIN_SHORTENING) * before:
            break
    return _straighten(path, field, min_clearance)


def is_line_clear(a: Array, b: Array, field: ClearanceField, min_clearance: float) -> bool:
    """Return whether a straight line keeps the clearance `min_clearance` in m, sampled twice per cell."""
    count = 2 + math.ceil(2 * math.dist(a, b) / field.grid.resolution)
    line = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
    return bool(field.has_clearance(line, min_clearance).all())


def _straighten(path: Array, field: ClearanceField, min_clearance: float) -> Array:
    """Return the path with straight lines to the farthest visible point, found by doubling and bisection."""
    kept, last = [0], len(path) - 1
    while kept[-1] < last:
        here = kept[-1]
        near, reach = here + 1, 2
        while near < last and is_line_clear(path[here], path[min(here + reach, last)], field, min_clearance):
            near, reach = min(here + reach, last), 2 * reach
        far = min(here + reach, last)
        while far - near > 1:
            middle = (near + far) // 2
            near, far = (
                (middle, far) if is_line_clear(path[here], path[middle], field, min_clearance) else (near, middle)
            )
        kept.append(near)
    return path[kept]


def _smooth(path: Array, field: ClearanceField, radius: float) -> Array:
    """Return a path after the smoothing steps of an elastic band."""
    path = path.copy()
    for _ in range(SMOOTHING_STEPS):
        path[1:-1] = (path[:-2] + path[2:]) / 2
        path[1:-1] += field.push_away(path[1:-1], radius)
    return path
