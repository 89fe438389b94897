"""Find the shortest paths of a disc-shaped robot through the static world."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polylines import polyline_length, resample_polyline
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.goals import Goal
from simscen.core.records.case import Passage
from simscen.grid_graph import CellIndices, GridGraph
from simscen.worlds.maps.map_size import Bounds
from simscen.worlds.routes.clearance import (
    HALF_DIAGONAL_CELLS,
    MIN_RESOLUTION_M,
    ClearanceField,
    clearance_field,
    search_grid,
)
from simscen.worlds.routes.narrow_gaps import narrowest_gap
from simscen.worlds.routes.passages import find_passages, passage_between

Z_RANGE_M = (0.03, 0.4)
"""Heights in m between which solids block a robot. Lower solids are sills to drive over."""
MIN_SHORTENING_RATIO = 0.001
"""A path is tightened in another round if the last round shortened it by at least this fraction."""
MAX_ROUNDS = 12
"""Maximum number of rounds in which a path is straightened and smoothed."""
SMOOTHING_STEPS = 24
"""Number of smoothing steps in each round."""


@dataclass(frozen=True)
class Leg:
    """The shortest path from one pose to a goal.

    length:    length in m; inf if there is no path
    passages:  passages on the path; without a path, the gap that is too narrow, or () if none was found
    """

    length: float
    passages: tuple[Passage, ...] = ()


class ShortestPaths:
    """Finds the shortest paths of a disc of one radius in one world.

    Lengths are exact to about 1 %. If the paths around both sides of an obstacle differ by less than 3 %, the longer
    path may be chosen. A radius smaller than 0.71 grid cells counts as 0.71 cells.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        bounds: Bounds,
        radius: float,
        z_range: tuple[float, float] = Z_RANGE_M,
        min_resolution: float = MIN_RESOLUTION_M,
    ) -> None:
        """Prepare the search.

        mesh:            static solids; only their parts between the heights `z_range` in m are obstacles
        bounds:          rectangle around the world and all starts and goals
        radius:          radius of the disc in m
        min_resolution:  size of the grid cells in m; in large worlds they are larger
        """
        grid = search_grid(bounds, radius, min_resolution)
        self._radius = max(radius, 0.71 * grid.resolution)
        self._is_radius_enlarged = radius < self._radius
        self._field = clearance_field(mesh, grid, z_range)
        self._min_clearance = self._radius - 0.1 * grid.resolution

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Return the length in m of the shortest path between two positions; inf if there is none."""
        path = self.path(start, goal)
        return math.inf if path is None else polyline_length(path)

    def clearances(self, points: Array) -> Array:
        """Return the distances (n,) in m from points (n, 2) to the nearest solid; negative inside of solids."""
        return self._field.clearance_at(points)

    def leg(self, start: Pose2, goal: Pose2, name: str) -> Leg:
        """Return the shortest path to the goal `name`, with its passages.

        If there is no path, the length is inf, and the only passage is the gap that is too narrow. There is no passage
        if the start or the goal is blocked, or if no such gap was found.
        """
        path = self.path(start, goal)
        if path is not None:
            return Leg(polyline_length(path), find_passages(path, name, self._field))
        if not self._field.has_clearance(np.array([start[:2], goal[:2]]), self._min_clearance).all():
            return Leg(math.inf)
        gap = narrowest_gap(self._field, (start, goal), self._radius)
        return Leg(math.inf, (passage_between(gap.sides, name, self._field),) if gap.sides else ())

    def path(self, start: Pose2, goal: Pose2) -> Array | None:
        """Return the points (n, 2) of the shortest path, with arcs as short chords; None if there is no path."""
        ends = np.array([start[:2], goal[:2]])
        if not self._field.has_clearance(ends, self._min_clearance).all():
            return None
        if is_line_clear(ends[0], ends[1], self._field, self._min_clearance):
            return ends
        path = self._search(self._optimistic_graph, ends)
        if path is None or all(is_line_clear(a, b, self._field, self._min_clearance) for a, b in pairwise(path)):
            return path
        return self._search(self._strict_graph, ends)

    def may_reach(self, start: Pose2, goal: Pose2) -> bool:
        """Return whether there may be a path between two positions; False proves that there is none."""
        if self._is_radius_enlarged:
            return True
        first, last = (self._free_cell(self._optimistic_graph, np.array(end[:2])) for end in (start, goal))
        return not first or not last or self._optimistic_graph.shortest_path(first, last) is not None

    def may_enter(self, starts: Sequence[Pose2], distance: Callable[[Pose2], float]) -> bool:
        """Return whether there may be a path from one of the starts into an area; False proves that there is none.

        `distance` returns the distance in m from a pose to the area, and at most 0 inside.
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
        """Graph of all cells in which the center of the disc may be. Some gaps in it may be too narrow."""
        return GridGraph(self._field.free_cells(self._radius - HALF_DIAGONAL_CELLS * self._field.grid.resolution))

    @cached_property
    def _strict_graph(self) -> GridGraph:
        """Graph of the cells with room for the disc at their center. Gaps hardly wider than the disc may be missed."""
        return GridGraph(self._field.free_cells(self._radius))

    def _search(self, graph: GridGraph, ends: Array) -> Array | None:
        """Return the path (n, 2) between `ends` (2, 2) over a graph, after `tighten_path`; None if there is no path."""
        first, last = (self._free_cell(graph, end) for end in ends)
        cells = graph.shortest_path(first, last) if first and last else None
        if cells is None:
            return None
        inner = self._field.grid.center_of(cells)
        return tighten_path(np.concatenate((ends[:1], inner, ends[1:])), self._field, self._radius)

    def _free_cell(self, graph: GridGraph, point: Array) -> tuple[int, int] | None:
        """Return the free cell (row, column) nearest to a point (2,); None if no cell within two cells is free."""
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
    """Prepare the search for paths in a built world, in an area that contains all `stops` (starts and goals)."""
    x0, y0, x1, y1 = built.world.bounds
    corners = [(x0, y0), (x1, y1)] if any(built.world.bounds) else built.map.corners
    xs, ys = zip(*corners, *(stop[:2] for stop in stops), strict=True)
    return ShortestPaths(built.mesh, (min(xs), min(ys), max(xs), max(ys)), radius, z_range, min_resolution)


def legs_between(built: BuiltWorld, ends: Sequence[tuple[Pose2, Goal]], radius: float) -> list[Leg]:
    """Return the shortest path of a disc for each pair (start, goal) of `ends`."""
    if not ends:
        return []
    paths = shortest_paths_in(built, [pose for start, goal in ends for pose in (start, goal.pose)], radius)
    found: dict[tuple[Pose2, Pose2], Leg] = {}
    legs = []
    for start, goal in ends:
        if (start, goal.pose) not in found:
            found[start, goal.pose] = paths.leg(start, goal.pose, goal.name)
        leg = found[start, goal.pose]
        legs.append(replace(leg, passages=tuple(replace(each, goal=goal.name) for each in leg.passages)))
    return legs


def tighten_path(path: Array, field: ClearanceField, radius: float) -> Array:
    """Return a path (n, 2) that is shortened, but keeps `radius` m away from solids (tolerance: 0.1 cells).

    String pulling creates straight parts. Between them, an elastic band (Quinlan and Khatib 1993) moves the path onto
    arcs around obstacles.
    """
    min_clearance = radius - 0.1 * field.grid.resolution
    for _ in range(MAX_ROUNDS):
        before = polyline_length(path)
        path = _smooth(resample_polyline(_straighten(path, field, min_clearance), field.grid.resolution), field, radius)
        if polyline_length(path) > (1 - MIN_SHORTENING_RATIO) * before:
            break
    return _straighten(path, field, min_clearance)


def is_line_clear(a: Array, b: Array, field: ClearanceField, min_clearance: float) -> bool:
    """Return whether the line from `a` to `b` keeps `min_clearance` m away from solids, sampled twice per cell."""
    count = 2 + math.ceil(2 * math.dist(a, b) / field.grid.resolution)
    line = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
    return bool(field.has_clearance(line, min_clearance).all())


def _straighten(path: Array, field: ClearanceField, min_clearance: float) -> Array:
    """Return few points of `path` (n, 2), with clear straight lines between them (string pulling)."""
    # From each corner, the farthest point with a clear line is searched by doubling the step and bisection.
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
    """Return a path (n, 2) after SMOOTHING_STEPS of an elastic band, which keeps `radius` m away from solids."""
    path = path.copy()
    for _ in range(SMOOTHING_STEPS):
        path[1:-1] = (path[:-2] + path[2:]) / 2
        path[1:-1] += field.push_away(path[1:-1], radius)
    return path
