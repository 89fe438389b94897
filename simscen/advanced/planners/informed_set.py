"""Informed set: the region of near-shortest paths over a coarse grid, in which OMPL's planners sample.

Source: Gammell et al., Informed RRT* (2014). Their informed set is an ellipse: for its points, the sum of the straight
distances from start and goal has a limit. Here, both distances are measured along paths over a coarse grid, whose
blocks consist of several costmap cells.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import dijkstra

from simscen.advanced.cell_blocks import cells_with_most_clearance
from simscen.advanced.planners.block_graph import block_graph
from simscen.core.geometry import Array
from simscen.stack.moving_obstacles import Mask
from simscen.stack.planners.ompl_search import Point
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView

BLOCK_M, COST_BLOCK_M = 0.2, 0.15
"""Approximate side length of the blocks for shortest paths, and for cheapest paths (`by_cost`)."""
MAX_BLOCKS, MAX_COST_BLOCKS = 40_000, 20_000
"""Approximate maximum numbers of blocks. Larger maps get larger blocks, but at most as wide as the robot."""
PATH_SPACING_M = 0.45
"""Distance between the points of `InformedSet.path` where there is ample clearance."""
MAX_LEG_M = 30.0
"""Maximum distance between successive `waypoints`."""


class InformedSet:
    """Points on near-shortest paths from start to goal; the entire map before `restrict` is called.

    `length` is the length of the shortest path in m; inf without a path. Paths move from block to block in 16
    directions, like a king or a knight in chess, and are up to 2.8 % too long.
    """

    def __init__(self, costs: TraversalCosts, start: Point, goal: Point, by_cost: bool = False) -> None:
        """Search the shortest paths. If `by_cost`, all lengths are traversal costs; one meter in free space costs 1."""
        size, max_blocks = (COST_BLOCK_M, MAX_COST_BLOCKS) if by_cost else (BLOCK_M, MAX_BLOCKS)
        max_factor = max(1, int(2.0 * costs.inscribed / costs.resolution))
        min_factor = min(math.ceil(math.sqrt(costs.height * costs.width / max_blocks)), max_factor)
        self._factor = max(1, round(size / costs.resolution), min_factor)
        self._size = self._factor * costs.resolution
        self._origin = costs.origin
        self._height, self._width = -(-costs.height // self._factor), -(-costs.width // self._factor)
        end_blocks = [self._index(*start), self._index(*goal)]
        graph = costs.cache.get((self._factor, by_cost))
        if graph is None:
            costs.cache[self._factor, by_cost] = graph = block_graph(costs, self._factor, by_cost)
        lengths, self._predecessors = dijkstra(graph, directed=False, indices=end_blocks, return_predecessors=True)
        distances: Array = lengths * self._size
        self._from_start, self._lengths_through = distances[0], distances[0] + distances[1]
        """For each block, the lengths of the shortest path from the start, and through the block to the goal."""
        self._goal_block = end_blocks[1]
        self.length = float(distances[0][self._goal_block])
        self._contained = b"\1" * len(self._lengths_through)
        """For each block, 1 if the block is in the set, else 0; as bytes, because `contains` is called very often."""

    def restrict(self, slack: float, section: tuple[float, float] = (0.0, math.inf)) -> None:
        """Restrict the set to paths that are longer than the shortest path by at most the ratio `slack`.

        `section` limits the distance of points from the start in m. All limits have a tolerance of two block diagonals.
        Earlier restrictions no longer apply.
        """
        tolerance = 2 * math.sqrt(2.0) * self._size
        is_inside = self._lengths_through <= self.length * (1.0 + slack) + tolerance
        low, high = section
        if low > 0.0 or high < self.length:
            is_inside &= (self._from_start >= low - tolerance) & (self._from_start <= high * (1.0 + slack) + tolerance)
        self._contained = is_inside.tobytes()

    def contains_points(self, points: Array) -> Mask:
        """Return which of the points (n, 2) are in the set."""
        inside: Mask = np.frombuffer(self._contained, dtype=bool)[self._blocks(points)]
        return inside

    def lengths_through(self, points: Array) -> Array:
        """Return the lengths (n,) in m of the shortest paths from start to goal through points (n, 2)."""
        return np.asarray(self._lengths_through[self._blocks(points)])

    def _blocks(self, points: Array) -> npt.NDArray[np.int64]:
        """Return the indices (n,) of the blocks that contain points (n, 2)."""
        columns, rows = ((points - self._origin) / self._size).astype(np.int64).T
        return np.asarray(rows * self._width + columns)

    def path(self, costmap: CostmapView, ample_clearance: float) -> Array:
        """Return for each block of the shortest path the point (n, 2) with the most clearance, without start and goal.

        Where the clearance is at least `ample_clearance` m, only points PATH_SPACING_M apart are returned.
        """
        blocks = [int(self._predecessors[0, self._goal_block])]
        while blocks[-1] >= 0:
            blocks.append(int(self._predecessors[0, blocks[-1]]))
        inner = np.array(blocks[:-2], dtype=np.int64)
        rows, columns = self._cells_with_most_clearance(costmap, inner)
        stride = max(1, round(PATH_SPACING_M / self._size))
        chosen = (costmap.distance[rows, columns] < ample_clearance) | (np.arange(len(rows)) % stride == 0)
        points: Array = (np.column_stack((columns, rows))[chosen] + 0.5) * costmap.resolution + self._origin
        return points

    def waypoints(self, costmap: CostmapView) -> list[tuple[Point, float]]:
        """Return points at most MAX_LEG_M apart on a near-shortest path, with their distances in m along the path.

        A tree planner needs far fewer samples for several short legs than for one long path.
        """
        legs = math.ceil(self.length / MAX_LEG_M) if math.isfinite(self.length) else 1
        distances = [self.length * number / legs for number in range(1, legs)]
        return [(self._point_with_most_clearance(costmap, distance), distance) for distance in distances]

    def _point_with_most_clearance(self, costmap: CostmapView, distance: float) -> Point:
        """Return the point with the most clearance on near-shortest paths, `distance` m from the start."""
        is_near_shortest = self._lengths_through <= self.length + 2 * self._size
        blocks = np.flatnonzero(is_near_shortest & (np.abs(self._from_start - distance) <= self._size))
        rows, columns = self._cells_with_most_clearance(costmap, blocks)
        best = np.lexsort((columns, rows, costmap.distance[rows, columns]))[-1]
        x = self._origin[0] + (int(columns[best]) + 0.5) * costmap.resolution
        return x, self._origin[1] + (int(rows[best]) + 0.5) * costmap.resolution

    def _cells_with_most_clearance(
        self, costmap: CostmapView, blocks: npt.NDArray[np.int64]
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Return the row and the column of the cell with the most clearance in each of the blocks (n,)."""
        return cells_with_most_clearance(
            costmap.distance, np.column_stack(np.divmod(blocks, self._width)), self._factor
        )

    def bounds(self) -> tuple[float, float, float, float]:
        """Return (min x, min y, max x, max y) of the set in m."""
        rows, columns = np.nonzero(np.frombuffer(self._contained, dtype=bool).reshape(self._height, self._width))
        x, y, size = self._origin[0], self._origin[1], self._size
        return (
            float(x + columns.min() * size),
            float(y + rows.min() * size),
            float(x + (columns.max() + 1) * size),
            float(y + (rows.max() + 1) * size),
        )

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point is in the set."""
        return bool(self._contained[self._index(x, y)])

    def _index(self, x: float, y: float) -> int:
        """Return the index of the block that contains a point, or of the nearest block."""
        column = min(self._width - 1, max(0, int((x - self._origin[0]) / self._size)))
        row = min(self._height - 1, max(0, int((y - self._origin[1]) / self._size)))
        return int(row * self._width + column)
