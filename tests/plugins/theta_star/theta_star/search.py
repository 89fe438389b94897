"""Lazy Theta*: any-angle path search that checks the line of sight to the parent when a cell is expanded."""

import heapq
import math

import numpy as np

from simscen.plugin import Array, CostmapView, distances

Cell = tuple[int, int]
XY = tuple[float, float]
NEIGHBORS = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]


class Grid:
    """Cells of `edge` meters over a costmap; a place is free where it is farther than `room` from anything lethal."""

    def __init__(self, costmap: CostmapView, edge: float, room: float) -> None:
        self._costmap, self._edge, self._room = costmap, edge, room
        height, width = (math.floor(size * costmap.resolution / edge) for size in costmap.costs.shape)
        y, x = (np.indices((height, width)) + 0.5) * edge
        places = np.stack((x + costmap.origin[0], y + costmap.origin[1]), axis=-1)
        self.free: Array = distances(costmap, places) > room

    def place(self, cell: Cell) -> XY:
        """The middle of a cell in the map."""
        x, y = self._costmap.origin
        return x + (cell[1] + 0.5) * self._edge, y + (cell[0] + 0.5) * self._edge

    def nearest(self, place: XY, most: float) -> Cell | None:
        """The free cell nearest to a place, at most so far away in meters; None where there is none."""
        rows, columns = np.nonzero(self.free)
        x, y = self._costmap.origin
        away = np.hypot(x + (columns + 0.5) * self._edge - place[0], y + (rows + 0.5) * self._edge - place[1])
        if not len(away) or away.min() > most:
            return None
        best = int(away.argmin())
        return int(rows[best]), int(columns[best])

    def sees(self, one: Cell, other: Cell) -> bool:
        """Whether the straight line between two cells is free."""
        return self.clear(self.place(one), self.place(other))

    def clear(self, one: XY, other: XY) -> bool:
        """Whether the straight line between two places is free."""
        a, b = np.array(one), np.array(other)
        count = math.ceil(float(np.hypot(*(b - a))) / self._costmap.resolution * 2) + 1
        line = a + (b - a) * np.linspace(0.0, 1.0, count)[:, None]
        return bool((distances(self._costmap, line) > self._room).all())

    def around(self, cell: Cell) -> list[Cell]:
        """The free neighbors."""
        height, width = self.free.shape
        near = [(cell[0] + r, cell[1] + c) for r, c in NEIGHBORS]
        return [(r, c) for r, c in near if 0 <= r < height and 0 <= c < width and self.free[r, c]]


def lazy_theta_star(grid: Grid, begin: Cell, end: Cell) -> list[XY] | None:
    """The corners of a short path between two free cells; None where there is no path."""
    cost, parent = {begin: 0.0}, {begin: begin}
    closed: set[Cell] = set()
    queue = [(math.dist(begin, end), begin)]
    while queue:
        _, cell = heapq.heappop(queue)
        if cell in closed:
            continue
        if parent[cell] != cell and not grid.sees(parent[cell], cell):
            # Out of sight after all: come from the best neighbor that has been expanded.
            known = [(cost[near] + math.dist(near, cell), near) for near in grid.around(cell) if near in closed]
            cost[cell], parent[cell] = min(known)
        if cell == end:
            return _corners(grid, parent, end)
        closed.add(cell)
        for near in grid.around(cell):
            through = cost[parent[cell]] + math.dist(parent[cell], near)
            if near not in closed and through < cost.get(near, math.inf):
                cost[near], parent[near] = through, parent[cell]
                heapq.heappush(queue, (through + math.dist(near, end), near))
    return None


def _corners(grid: Grid, parent: dict[Cell, Cell], end: Cell) -> list[XY]:
    corners = [end]
    while parent[corners[-1]] != corners[-1]:
        corners.append(parent[corners[-1]])
    return [grid.place(cell) for cell in reversed(corners)]
