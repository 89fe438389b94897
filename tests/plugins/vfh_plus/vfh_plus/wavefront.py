"""Wavefront planner: Dijkstra distances to the goal on a map, and the direction of steepest descent."""

import heapq
import math

import numpy as np
from scipy.ndimage import distance_transform_edt

from simscen.plugin import Array, OccupancyGrid

EDGE = 0.1
"""Meters: the cells of the wavefront."""
ROOMY, CROWDED = 0.35, 3.0
"""Meters beyond the robot's radius within which a step costs up to CROWDED times as much: ways keep off walls."""
STEPS = [(r, c, math.hypot(r, c)) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]


class Terrain:
    """A map with what was seen besides, for a robot of a radius."""

    def __init__(self, grid: OccupancyGrid, seen: Array, radius: float, forbidden: Array) -> None:
        """`seen` (n, 2) are obstacles on no map, `forbidden` (n, 2) places to keep out of; in the map frame."""
        rows, columns = (max(1, round(size * grid.resolution / EDGE)) for size in grid.shape)
        middles = (np.indices((rows, columns)).reshape(2, -1).T[:, ::-1] + 0.5) * EDGE
        self._grid, self._shape = grid, (rows, columns)
        solid = (grid.values_at(grid.origin.apply(middles)) > 50).reshape(rows, columns)
        for points in (seen, forbidden):
            cells = self._cells(points)
            solid[cells[:, 0], cells[:, 1]] = True
        room = distance_transform_edt(~solid) * EDGE - radius
        self.open = room > 0
        self._weight = 1.0 + (CROWDED - 1.0) * np.clip(1.0 - room / ROOMY, 0.0, 1.0)

    def way(self, start: tuple[float, float], goal: tuple[float, float]) -> Array | None:
        """Places (n, 2) from start to goal in the map frame; None where there is no way."""
        begin, end = self._nearest(start), self._nearest(goal)
        if begin is None or end is None:
            return None
        cost, queue = {end: 0.0}, [(0.0, end)]
        next_of: dict[tuple[int, int], tuple[int, int]] = {}
        done = set()
        while queue:
            spent, cell = heapq.heappop(queue)
            if cell in done:
                continue
            done.add(cell)
            if cell == begin:
                return self._places(next_of, begin, goal)
            for r, c, length in STEPS:
                near = (cell[0] + r, cell[1] + c)
                if not (0 <= near[0] < self._shape[0] and 0 <= near[1] < self._shape[1]) or not self.open[near]:
                    continue
                total = spent + length * float(self._weight[near])
                if total < cost.get(near, math.inf):
                    cost[near], next_of[near] = total, cell
                    heapq.heappush(queue, (total, near))
        return None

    def _places(self, next_of: dict[tuple[int, int], tuple[int, int]], cell: tuple[int, int],
                goal: tuple[float, float]) -> Array:  # fmt: skip
        cells = [cell]
        while cell in next_of:
            cells.append(cell := next_of[cell])
        middles = (np.array(cells, dtype=np.float64)[:, ::-1] + 0.5) * EDGE
        return np.concatenate((self._grid.origin.apply(middles), np.array([goal])))

    def _cells(self, points: Array) -> Array:
        local = self._grid.origin.inverse().apply(points.reshape(-1, 2))
        cells = np.floor(local[:, ::-1] / EDGE).astype(np.int64)
        return cells[((cells >= 0) & (cells < self._shape)).all(axis=1)]

    def _nearest(self, place: tuple[float, float]) -> tuple[int, int] | None:
        rows, columns = np.nonzero(self.open)
        if not len(rows):
            return None
        local = self._grid.origin.inverse().apply(np.array([place]))[0] / EDGE
        away = np.hypot(columns + 0.5 - local[0], rows + 0.5 - local[1]) * EDGE
        best = int(away.argmin())
        return (int(rows[best]), int(columns[best])) if away[best] < 0.6 else None


def inside(polygon: tuple[tuple[float, float], ...]) -> Array:
    """Places (n, 2) inside a polygon, a cell apart."""
    corners = np.array(polygon, dtype=np.float64)
    axes = [np.arange(low, high, EDGE) for low, high in zip(corners.min(axis=0), corners.max(axis=0), strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    odd = np.zeros(len(places), dtype=bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (ay > places[:, 1]) != (by > places[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            odd ^= crosses & (places[:, 0] < ax + (places[:, 1] - ay) / (by - ay) * (bx - ax))
    return places[odd]
