"""Where a near-shortest path can be: Gammell et al.'s informed set (2014), measured through the maze.

Their ellipse is the set of points x with |start x| + |x goal| ≤ c. Between walls straight distances say little, so both
are measured along a coarse grid here. OMPL's planners then search only where a path at most `slack` longer than the
coarse one can pass: a tree planner cannot lose itself in a wrong room, and finds that way sooner as well.

The grid is no `ways.Lattice`: that one steps between free cells, while a block here is passed where free cells touch
across its borders, so that a gap narrower than a block stays open and a wall thinner than one stays shut.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from simscen.advanced.planners.blocks import pooled, roomiest
from simscen.core.geometry import Array
from simscen.stack.planners.ompl_search import Point
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView

BLOCK, PRICED_BLOCK = 0.2, 0.15
"""Meters, about: the coarse grid's resolution."""
MOST_BLOCKS, MOST_PRICED = 40_000, 20_000
"""Larger maps get larger blocks: Dijkstra on 40 000 takes 10 ms. None is wider than the robot, though, for in one that
holds a wall both sides of the wall would be one place."""
SPARSE = 0.45
"""Meters between the places of a way where there is room: every third block, or every one on a large map."""
LEG = 30.0
"""Meters of a way that are searched in one go."""
Mask = npt.NDArray[np.bool_]


class InformedSet:
    """The points on near-shortest ways from start to goal; `length` is about that of the shortest, in meters.

    Distances are those of king's and knight's moves, at most 2.8 % too long (8.2 % without the knight).
    """

    def __init__(self, rates: TraversalCosts, start: Point, goal: Point, priced: bool = False) -> None:
        """`priced`: by what ways cost, in meters of free ground, rather than by their lengths."""
        size, most = (PRICED_BLOCK, MOST_PRICED) if priced else (BLOCK, MOST_BLOCKS)
        widest = max(1, int(2.0 * rates.inscribed / rates.resolution))
        fewest = min(math.ceil(math.sqrt(rates.height * rates.width / most)), widest)
        self._factor = max(1, round(size / rates.resolution), fewest)
        self._size = self._factor * rates.resolution
        self._origin = rates.origin
        self._height, self._width = -(-rates.height // self._factor), -(-rates.width // self._factor)
        ends = [self._index(*start), self._index(*goal)]
        graph = rates.kept.get((self._factor, priced))
        if graph is None:
            rates.kept[self._factor, priced] = graph = _graph(rates, self._factor, priced)
        lengths, self._before = dijkstra(graph, directed=False, indices=ends, return_predecessors=True)
        through: Array = lengths * self._size
        self._along, self._sum, self._end = through[0], through[0] + through[1], ends[1]
        self.length = float(through[0][ends[1]])
        self._inside = b"\1" * len(self._sum)

    def narrow(self, slack: float, leg: tuple[float, float] = (0.0, math.inf)) -> None:
        """Keep the blocks on ways at most `slack` (ratio) longer than the shortest, and a block's diagonal more.

        `leg` keeps those only that are so many meters along such a way.
        """
        more = 2 * math.sqrt(2.0) * self._size
        inside = self._sum <= self.length * (1.0 + slack) + more
        low, high = leg
        if low > 0.0 or high < self.length:
            inside &= (self._along >= low - more) & (self._along <= high * (1.0 + slack) + more)
        self._inside = inside.tobytes()

    def holds(self, points: Array) -> Mask:
        """Which of the points (n, 2) lie in the set."""
        held: Mask = np.frombuffer(self._inside, dtype=bool)[self._blocks(points)]
        return held

    def through(self, points: Array) -> Array:
        """How long the shortest ways through each of the points (n, 2) are, or what they cost."""
        return np.asarray(self._sum[self._blocks(points)])

    def _blocks(self, points: Array) -> npt.NDArray[np.int64]:
        columns, rows = ((points - self._origin) / self._size).astype(np.int64).T
        return np.asarray(rows * self._width + columns)

    def way(self, costmap: CostmapView, roomy: float) -> Array:
        """The places (n, 2) with most room in the blocks of the way itself, but those of its ends; where there is as
        much as `roomy` meters, those `SPARSE` meters apart only.
        """
        blocks = [int(self._before[0, self._end])]
        while blocks[-1] >= 0:
            blocks.append(int(self._before[0, blocks[-1]]))
        between = np.array(blocks[:-2], dtype=np.int64)
        rows, columns = roomiest(costmap.distance, np.column_stack(np.divmod(between, self._width)), self._factor)
        every = max(1, round(SPARSE / self._size))
        kept = (costmap.distance[rows, columns] < roomy) | (np.arange(len(rows)) % every == 0)
        places: Array = (np.column_stack((columns, rows))[kept] + 0.5) * costmap.resolution + self._origin
        return places

    def stops(self, costmap: CostmapView) -> list[tuple[Point, float]]:
        """Points of a near-shortest way to search between, at most LEG meters apart, and how far along they are.

        A tree that fills 20 m in a hundred samples needs many thousands for 200 m with a door each ten.
        """
        legs = math.ceil(self.length / LEG) if math.isfinite(self.length) else 1
        return [self._roomiest(costmap, self.length * leg / legs) for leg in range(1, legs)]

    def _roomiest(self, costmap: CostmapView, along: float) -> tuple[Point, float]:
        """The place with most room in the blocks of the shortest ways that are so far along."""
        on_way = self._sum <= self.length + 2 * self._size
        blocks = np.flatnonzero(on_way & (np.abs(self._along - along) <= self._size)).tolist()
        cells = [self._best_cell(costmap, *divmod(block, self._width)) for block in blocks]
        _, row, column = max(cells)
        x = self._origin[0] + (column + 0.5) * costmap.resolution
        return (x, self._origin[1] + (row + 0.5) * costmap.resolution), along

    def _best_cell(self, costmap: CostmapView, row: int, column: int) -> tuple[float, int, int]:
        top, left = row * self._factor, column * self._factor
        part = costmap.distance[top : top + self._factor, left : left + self._factor]
        best, width = int(part.argmax()), part.shape[1]
        return float(part.flat[best]), top + best // width, left + best % width

    def bounds(self) -> tuple[float, float, float, float]:
        """(min x, min y, max x, max y) of the set."""
        rows, columns = np.nonzero(np.frombuffer(self._inside, dtype=bool).reshape(self._height, self._width))
        x, y, size = self._origin[0], self._origin[1], self._size
        return (
            float(x + columns.min() * size),
            float(y + rows.min() * size),
            float(x + (columns.max() + 1) * size),
            float(y + (rows.max() + 1) * size),
        )

    def has(self, x: float, y: float) -> bool:
        """Whether a point lies in the set."""
        return bool(self._inside[self._index(x, y)])

    def _index(self, x: float, y: float) -> int:
        column = min(self._width - 1, max(0, int((x - self._origin[0]) / self._size)))
        row = min(self._height - 1, max(0, int((y - self._origin[1]) / self._size)))
        return int(row * self._width + column)


def _cut(free: Mask, factor: int) -> Mask:
    """The cells cut to blocks (rows, columns, factor, factor), with blocked ones added to fill the last."""
    height, width = (-(-side // factor) * factor for side in free.shape)
    padded = np.zeros((height, width), dtype=bool)
    padded[: free.shape[0], : free.shape[1]] = free
    return np.asarray(padded.reshape(height // factor, factor, width // factor, factor).transpose(0, 2, 1, 3))


def _steps(blocks: Mask) -> dict[tuple[int, int], Mask]:
    """For each king's and knight's move (rows, columns) the blocks from which it can be made.

    To the next block over one of four sides: where free cells touch on both sides of the border. Any other move: if
    the blocks it passes can be crossed so; a knight needs both ways around.
    """
    right, up = np.zeros(blocks.shape[:2], dtype=bool), np.zeros(blocks.shape[:2], dtype=bool)
    right[:, :-1] = (blocks[:, :-1, :, -1] & blocks[:, 1:, :, 0]).any(axis=2)
    up[:-1] = (blocks[:-1, :, -1] & blocks[1:, :, 0]).any(axis=2)
    left = _at(right, 0, -1)
    right_up = (right & _at(up, 0, 1)) | (up & _at(right, 1, 0))
    left_up = (left & _at(up, 0, -1)) | (up & _at(left, 1, 0))
    return {
        (0, 1): right,
        (1, 0): up,
        (1, 1): right_up,
        (1, -1): left_up,
        (1, 2): right & _at(right_up, 0, 1) & right_up & _at(right, 1, 1),
        (2, 1): up & _at(right_up, 1, 0) & right_up & _at(up, 1, 1),
        (1, -2): left & _at(left_up, 0, -1) & left_up & _at(left, 1, -1),
        (2, -1): up & _at(left_up, 1, 0) & left_up & _at(up, 1, -1),
    }


def _at(mask: Mask, rows: int, columns: int) -> Mask:
    """The mask as seen from blocks so many rows and columns before; False beyond its edge."""
    moved = np.zeros_like(mask)
    height, width = mask.shape
    left = max(0, -columns)
    moved[: height - rows, left : width - max(0, columns)] = mask[rows:, left + columns : width + min(0, columns)]
    return moved


def _graph(rates: TraversalCosts, factor: int, priced: bool) -> csr_matrix:
    """Edges between blocks a move apart, as long as the move in blocks, or times what both cost."""
    blocks = _cut(rates.free, factor)
    height, width = blocks.shape[:2]
    steps = _steps(blocks)
    moves = sorted(steps, key=lambda move: move[0] * width + move[1])
    onward = np.array([rows * width + columns for rows, columns in moves])
    lengths = np.array([math.hypot(*move) for move in moves])
    possible = np.stack([steps[move].reshape(-1) for move in moves], axis=1)
    at, move = possible.nonzero()  # block by block, as the matrix has them
    to = at + onward[move]
    if priced:
        price = _prices(rates, factor)
        length = (0.5 * lengths).astype(np.float32)[move] * (price[at] + price[to])
    else:
        length = lengths[move]
    begin = np.concatenate(([0], possible.sum(axis=1).cumsum()))
    return csr_matrix((length, to, begin), shape=(height * width, height * width))


def _prices(rates: TraversalCosts, factor: int) -> Array:
    """What a meter costs in each block, flat: between its best cell and the mean of those where the robot can be.

    The best alone makes nothing of what is dear for a cell or two, the mean makes a gap dearer than its middle.
    """
    finite = np.isfinite(rates.rates)
    least = pooled(rates.rates, factor, np.minimum, np.inf)
    total = pooled(np.where(finite, rates.rates, np.float32(0.0)), factor, np.add, 0.0)
    prices: Array = 0.5 * (least + total / np.maximum(pooled(finite, factor, np.add, 0.0), 1.0))
    return prices.reshape(-1)
