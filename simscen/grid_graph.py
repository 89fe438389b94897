"""Shortest paths over the free cells of a grid (Dijkstra's algorithm)."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

CellMask = npt.NDArray[np.bool_]
CellIndices = npt.NDArray[np.int64]
EIGHT_NEIGHBORS = tuple((a, b) for a in range(-1, 2) for b in range(-1, 2) if (a, b) != (0, 0))
"""Moves (rows, columns) to the eight neighbors. Paths are at most 8.2 % longer than a straight line."""
SIXTEEN_NEIGHBORS = tuple((a, b) for a in range(-2, 3) for b in range(-2, 3) if math.gcd(a, b) == 1)
"""Moves to the eight neighbors, and knight's moves. Paths are at most 2.8 % longer than a straight line."""


class GridGraph:
    """Graph of the free cells of a grid, whose edges are moves between cells.

    The two outermost rows and columns on each side count as not free.
    """

    def __init__(
        self,
        free: CellMask,
        moves: Sequence[tuple[int, int]] = SIXTEEN_NEIGHBORS,
        traversal_costs: npt.NDArray[np.floating] | None = None,
    ) -> None:
        """Build the graph of the `free` cells (rows, columns).

        A move costs its length in cells, times the mean of the `traversal_costs` of both ends if these are given.
        """
        from scipy.sparse import csr_array

        inner = np.zeros_like(free)
        inner[2:-2, 2:-2] = free[2:-2, 2:-2]
        self._width: int = free.shape[1]
        flat = inner.ravel()
        self._cells = np.flatnonzero(flat)
        self._node_of_cell: npt.NDArray[np.int32] = np.full(flat.size, -1, dtype=np.int32)
        self._node_of_cell[self._cells] = np.arange(len(self._cells), dtype=np.int32)
        possible = np.empty((len(self._cells), len(moves)), dtype=np.bool_)
        for k, move in enumerate(moves):
            possible[:, k] = flat[self._cells + self._flat_index(move)]
            for crossed in _crossed_cells(move):
                possible[:, k] &= flat[self._cells + self._flat_index(crossed)]
        targets = self._node_of_cell[self._cells[:, None] + np.array([self._flat_index(move) for move in moves])]
        lengths: npt.NDArray[np.floating] = np.array([math.hypot(*move) for move in moves])
        if traversal_costs is not None:
            cost = traversal_costs.ravel()[self._cells]
            lengths = 0.5 * (cost[:, None] + cost[targets]) * lengths
        row_starts: npt.NDArray[np.int32] = np.zeros(len(self._cells) + 1, dtype=np.int32)
        np.cumsum(possible.sum(axis=1), out=row_starts[1:])
        data = np.broadcast_to(lengths, possible.shape)[possible]
        self._graph = csr_array((data, targets[possible], row_starts), shape=(len(self._cells),) * 2)

    def shortest_path(self, start: tuple[int, int], goal: tuple[int, int]) -> CellIndices | None:
        """Return the cells (n, 2) of the cheapest path between two cells (row, column); None if there is no path."""
        from scipy.sparse.csgraph import dijkstra

        first, last = self._node(start), self._node(goal)
        if first < 0 or last < 0:
            return None
        lengths, predecessors = dijkstra(self._graph, indices=np.array([first]), return_predecessors=True)
        if not np.isfinite(lengths[0, last]):
            return None
        path = [last]
        while path[-1] != first:
            path.append(int(predecessors[0, path[-1]]))
        return np.column_stack(np.divmod(self._cells[path[::-1]], self._width))

    def connected_cells(self, cells: Sequence[tuple[int, int] | None]) -> CellIndices:
        """Return the free cells (n, 2) that are connected with any of the `cells` (row, column). None is ignored."""
        from scipy.sparse.csgraph import connected_components

        _, labels = connected_components(self._graph, directed=False)
        reachable_labels = [labels[self._node(cell)] for cell in cells if cell is not None and self._node(cell) >= 0]
        return np.column_stack(np.divmod(self._cells[np.isin(labels, reachable_labels)], self._width))

    def is_free(self, cells: CellIndices) -> CellMask:
        """Return which of the cells (n, 2) are free."""
        free: CellMask = self._node_of_cell[cells[:, 0] * self._width + cells[:, 1]] >= 0
        return free

    def _flat_index(self, cell: tuple[int, int]) -> int:
        return cell[0] * self._width + cell[1]

    def _node(self, cell: tuple[int, int]) -> int:
        """Return the index of the node of a cell; -1 if the cell is not free."""
        return int(self._node_of_cell[self._flat_index(cell)])


def _crossed_cells(move: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the cells between the ends of a move that must be free, relative to its start."""
    a, b = move
    if abs(a) == 2:
        return [(a // 2, 0), (a // 2, b)]
    if abs(b) == 2:
        return [(0, b // 2), (a, b // 2)]
    return [(a, 0), (0, b)] if a and b else []
