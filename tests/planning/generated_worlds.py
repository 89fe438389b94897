"""Generate worlds for tests of planners, and compute the cost of the cheapest path with Dijkstra on a grid."""

import math

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot

ROBOT = round_robot()
MOVES = [(a, b) for a in range(4) for b in range(-3, 4) if math.gcd(a, b) == 1 and (a > 0 or b > 0)]
"""Moves (rows, columns) between cells, without opposite moves. In 32 directions, a path is at most 1.3 % too long."""


def rooms(rng: np.random.Generator) -> tuple[Flatland, float, float]:
    """Return a world of 2 x 2 to 4 x 4 rooms with doors and random obstacles, and its width and height in m."""
    columns, rows = rng.integers(2, 5, 2).tolist()
    width, height = rng.uniform(3.5, 5.0, 2).tolist()
    world = Flatland().room(columns * width, rows * height)
    for i in range(columns):
        for j in range(rows):
            if i + 1 < columns:
                _wall(world, rng, True, (i + 1) * width, j * height, height, j == 0 or rng.random() < 0.5)
            if j + 1 < rows:
                _wall(world, rng, False, (j + 1) * height, i * width, width, rng.random() < 0.6)
    for x, y in rng.uniform((0.3, 0.3), (columns * width - 0.9, rows * height - 0.9), (columns * rows * 2, 2)):
        a, b = rng.uniform(0.2, 0.8, 2)
        world.boxes.append((x, y, x + a, y + b))
    return world, columns * width, rows * height


def _wall(
    world: Flatland, rng: np.random.Generator, along_y: bool, position: float, low: float, size: float, has_door: bool
) -> None:
    """Add a wall of length `size` that starts at `low`: along y at x = `position`, or along x at y = `position`."""
    gap = rng.uniform(0.8, 1.2)
    begin = rng.uniform(0.3, size - gap - 0.3)
    for a, b in ((low, low + begin), (low + begin + gap, low + size)) if has_door else ((low, low + size),):
        if along_y:
            world.boxes.append((position, a, position + 0.12, b))
        else:
            world.boxes.append((a, position, b, position + 0.12))


def forest(rng: np.random.Generator) -> tuple[Flatland, float, float]:
    """Return a world with round obstacles at random positions, and its width and height in m."""
    width, height = rng.uniform(8, 14, 2).tolist()
    world = Flatland().room(width, height)
    positions = rng.uniform((0.5, 0.5), (width - 0.5, height - 0.5), (int(width * height * rng.uniform(0.2, 0.5)), 2))
    world.discs = [(x, y, rng.uniform(0.08, 0.4)) for x, y in positions.tolist()]
    return world, width, height


def maze(rng: np.random.Generator) -> tuple[Flatland, float, float]:
    """Return a maze of which some walls are removed, and its width and height in m."""
    columns, rows = rng.integers(4, 7, 2).tolist()
    size = rng.uniform(1.0, 1.6)
    world = Flatland().room(columns * size, rows * size)
    visited, stack, passages = {(0, 0)}, [(0, 0)], set()
    while stack:
        x, y = stack[-1]
        neighbors = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        unvisited = [c for c in neighbors if 0 <= c[0] < columns and 0 <= c[1] < rows and c not in visited]
        if not unvisited:
            stack.pop()
            continue
        cell = unvisited[rng.integers(len(unvisited))]
        visited.add(cell)
        stack.append(cell)
        passages.add(frozenset(((x, y), cell)))
    for x in range(columns):
        for y in range(rows):
            right, up = (x + 1) * size, (y + 1) * size
            if x + 1 < columns and frozenset(((x, y), (x + 1, y))) not in passages and rng.random() > 0.1:
                world.boxes.append((right - 0.05, y * size, right + 0.05, up))
            if y + 1 < rows and frozenset(((x, y), (x, y + 1))) not in passages and rng.random() > 0.1:
                world.boxes.append((x * size, up - 0.05, right, up + 0.05))
    return world, columns * size, rows * size


def large_maze(number: int, rooms: int, edge: int) -> OccupancyGrid:
    """Return the map of a maze of `rooms` x `rooms` rooms without loops.

    Cells are 5 cm wide. `edge` is the width of a room in cells, with a wall of two cells.
    """
    rng, stack = np.random.default_rng(number), [(0, 0)]
    size = rooms * edge + 2
    cells = np.zeros((size, size), dtype=np.int8)
    for wall in range(0, size, edge):
        cells[wall : wall + 2] = cells[:, wall : wall + 2] = 100
    visited = {(0, 0)}
    while stack:
        x, y = stack[-1]
        neighbors = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        unvisited = [c for c in neighbors if min(c) >= 0 and max(c) < rooms and c not in visited]
        if not unvisited:
            stack.pop()
            continue
        u, v = unvisited[rng.integers(len(unvisited))]
        visited.add((u, v))
        stack.append((u, v))
        low, left = min(y, v) * edge + 2, min(x, u) * edge + 2
        cells[low : (max(y, v) + 1) * edge, left : (max(x, u) + 1) * edge] = 0
    return OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0))


def costmap_of(
    world: Flatland, width: float, height: float, robot: RobotModel = ROBOT, resolution: float = 0.05, **options: object
) -> CostmapView:
    """Return the costmap of a world between (0, 0) and (width, height); `options` are those of its specification."""
    bounds = (-0.5, -0.5, math.ceil(width) + 0.5, math.ceil(height) + 0.5)
    spec = CostmapSpec(resolution=resolution, **options)
    return LayeredCostmap(spec, Surroundings(robot, world.grid(bounds, resolution), TICK_RATE_HZ)).view


def random_query(rates: TraversalCosts, reachable: Array, rng: np.random.Generator) -> tuple[Pose2, Pose2]:
    """Return a random start and goal in `reachable` cells, at least 3 m apart."""
    cells = np.argwhere(reachable)
    while True:
        ends = (cells[rng.integers(len(cells), size=2)][:, ::-1] + 0.5) * rates.resolution + rates.origin
        if math.dist(*ends) > 3.0:
            return Pose2(*ends[0].tolist()), Pose2(*ends[1].tolist())


def cheapest_cost(rates: TraversalCosts, start: Pose2, goal: Pose2) -> float:
    """Return the cost of the cheapest path over the cells of a costmap.

    It is at most 1.3 % too high, and rarely slightly too low if the path cuts a corner.
    """
    costs = rates.rates.astype(np.float64)
    free, number = np.isfinite(costs), np.arange(costs.size).reshape(costs.shape)
    costs = np.where(free, costs, 0.0)
    height, width = costs.shape
    starts, ends, weights = [], [], []
    for rows, columns in MOVES:
        left = max(0, -columns)
        tall, wide = height - rows, width - abs(columns)

        def window(row: int, column: int, left: int = left, tall: int = tall, wide: int = wide) -> tuple[slice, slice]:
            return slice(row, row + tall), slice(left + column, left + column + wide)

        steps = 2 * max(rows, abs(columns))
        is_free, cost = np.ones((tall, wide), dtype=bool), np.zeros((tall, wide))
        for k in range(steps):  # sample the move in the middle of each half cell
            part = (k + 0.5) / steps
            cell = window(math.floor(rows * part + 0.5), math.floor(columns * part + 0.5))
            is_free &= free[cell]
            cost += costs[cell] / steps
        starts.append(number[window(0, 0)][is_free])
        ends.append(number[window(rows, columns)][is_free])
        weights.append(cost[is_free] * math.hypot(rows, columns) * rates.resolution)
    graph = csr_matrix(
        (np.concatenate(weights), (np.concatenate(starts), np.concatenate(ends))), shape=(number.size,) * 2
    )
    cells = [
        number[int((p.y - rates.origin[1]) / rates.resolution), int((p.x - rates.origin[0]) / rates.resolution)]
        for p in (start, goal)
    ]
    return float(dijkstra(graph, directed=False, indices=cells[0])[cells[1]])
