"""Where a near-shortest path can be: Gammell et al.'s informed set (2014), measured through the maze.

Their ellipse is the set of points x with |start x| + |x goal| ≤ c. Between walls straight distances say little, so both
are measured along a coarse grid here. OMPL's planners then search only where a path at most `slack` longer than the
coarse one can pass: a tree planner cannot lose itself in a wrong room, and finds that way sooner as well.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from simscen.core.geometry import Array
from simscen.stack.planners.field import Field
from simscen.stack.planners.search import Point

BLOCK = 0.2
"""Metres, about: the coarse grid's resolution. A block is free when any of its cells is."""
KNIGHT = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))
"""Steps (rows, columns) of a grid whose distances are at most 2.8 % too long; 8 neighbours err by 8.2 %."""


class InformedSet:
    """The points on near-shortest ways from start to goal; `length` is about that of the shortest, in metres."""

    def __init__(self, field: Field, start: Point, goal: Point, radius: float) -> None:
        self._factor = max(1, round(BLOCK / field.resolution))
        self._size = self._factor * field.resolution
        self._origin = field.origin
        free = _pooled(field.costmap.distance > radius, self._factor)
        self._height, self._width = free.shape
        ends = [self._index(*start), self._index(*goal)]
        through: Array = dijkstra(_graph(free), directed=False, indices=ends) * self._size
        self._sum = through[0] + through[1]
        self.length = float(through[0][ends[1]])
        self._inside = b"\1" * len(self._sum)

    def narrow(self, slack: float) -> None:
        """Keep the blocks on ways at most `slack` (ratio) longer than the shortest, and a block's diagonal more."""
        limit = self.length * (1.0 + slack) + 2 * math.sqrt(2.0) * self._size
        self._inside = (self._sum <= limit).tobytes()

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


def _pooled(free: npt.NDArray[np.bool_], factor: int) -> npt.NDArray[np.bool_]:
    height, width = (-(-side // factor) * factor for side in free.shape)
    padded = np.zeros((height, width), dtype=bool)
    padded[: free.shape[0], : free.shape[1]] = free
    return np.asarray(padded.reshape(height // factor, factor, width // factor, factor).any(axis=(1, 3)))


def _graph(free: npt.NDArray[np.bool_]) -> "csr_matrix":
    """Edges between free blocks a knight's or king's move apart; the blocks that a knight jumps over must be free."""
    height, width = free.shape
    number = np.arange(height * width, dtype=np.int32).reshape(height, width)
    starts, ends, lengths = [], [], []
    for rows, columns in KNIGHT:
        left = max(0, -columns)
        a = (slice(0, height - rows), slice(left, width - max(0, columns)))
        b = (slice(rows, height), slice(left + columns, width + min(0, columns)))
        open_ = free[a] & free[b]
        if rows + abs(columns) == 3:
            open_ &= free[_moved(a, rows // 2, int(columns / 2))] & free[_moved(b, -(rows // 2), -int(columns / 2))]
        starts.append(number[a][open_])
        ends.append(number[b][open_])
        lengths.append(np.full(len(starts[-1]), math.hypot(rows, columns)))
    entries = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
    return csr_matrix(entries, shape=(height * width, height * width))


def _moved(window: tuple[slice, slice], rows: int, columns: int) -> tuple[slice, slice]:
    return (
        slice(window[0].start + rows, window[0].stop + rows),
        slice(window[1].start + columns, window[1].stop + columns),
    )
