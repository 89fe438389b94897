"""Exact squared Euclidean distance transforms of grids, complete or up to a maximum distance.

Up to a few meters, comparing neighbors in 16-bit integers is faster than scipy's transform (see docs/design/speed.md).
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

ROWS_PER_BLOCK = 64
"""Number of rows of a block of `squared_distance_blocks`."""
MAX_INT32_EDGE_CELLS = 30_000
"""Longest edge of a grid for which squared distances fit into 32 bits."""

MAX_REACH_CELLS = 180
"""Largest supported `reach`, the maximum distance: the sum of two squares must fit into 16 bits."""
OUT_OF_REACH = 65535
"""Largest value in 16 bits. It stands for squared distances that are larger or not computed."""
MAX_COMPARED_CELLS = 60
"""Largest `reach` for which comparing neighbors is faster than scipy's transform."""
BLOCK_SIZE = 150_000
"""Number of values that are compared at once, so that they fit into a processor cache."""

Squares = npt.NDArray[np.uint16]
_SQUARED_OFFSETS: Squares = (np.arange(1, MAX_REACH_CELLS + 1) ** 2).astype(np.uint16)[:, None, None]


def squared_distances_within(marked: npt.NDArray[np.bool_], reach: int) -> Squares:
    """Return the squared distance in cells from each cell to the nearest marked cell.

    Exact up to `reach` cells (at most MAX_REACH_CELLS); farther cells have the value reach² + 1.
    """
    return SquaredDistanceTransform(marked.shape, reach, reuse=False).transform(marked)


class SquaredDistanceTransform:
    """Computes the same as `squared_distances_within` for several grids of one shape, with buffers allocated once.

    The transform is separable: one pass along the rows, then one along the columns.
    """

    def __init__(self, shape: tuple[int, ...], reach: int, reuse: bool = True) -> None:
        """Allocate buffers for grids of a shape (rows, columns). With `reuse`, optimize for more than one grid."""
        self._reach, self._beyond = reach, reach * reach + 1
        if reach > MAX_COMPARED_CELLS:
            return
        height, width = shape
        rows, columns = (
            max(1, min(size, BLOCK_SIZE // (reach * other_size))) for size, other_size in (shape, shape[::-1])
        )
        buffer = np.empty(reach * max(rows * width, columns * height), dtype=np.uint16)
        self._along = _AxisPass(width, height, reach, buffer[: reach * columns * height], reuse)
        self._across = _AxisPass(height, width, reach, buffer[: reach * rows * width], reuse)
        self._squared: Squares = np.empty((height, width), dtype=np.uint16)

    def transform(self, marked: npt.NDArray[np.bool_]) -> Squares:
        """Return the squared distances (rows, columns) of a grid; valid until the next call."""
        if self._reach > MAX_COMPARED_CELLS:
            return self._by_scipy(marked)
        cells = self._along.values
        cells.fill(self._beyond)
        np.copyto(cells, np.uint16(0), where=marked.T)
        self._along.run(self._across.values.T)
        self._across.run(self._squared)
        return self._squared

    def _by_scipy(self, marked: npt.NDArray[np.bool_]) -> Squares:
        """Return the same, computed with scipy's transform."""
        result: Squares = np.full(marked.shape, self._beyond, np.uint16)
        if marked.any():
            for rows, squared in squared_distance_blocks(marked):
                result[rows] = np.minimum(squared, self._beyond)
        return result


class _AxisPass:
    """One pass along the first axis: each result is the minimum of (value + offset²) over offsets up to `reach`."""

    def __init__(self, height: int, width: int, reach: int, buffer: Squares, reuse: bool) -> None:
        padded = np.full((height + 2 * reach, width), reach * reach + 1, dtype=np.uint16)
        self.values: Squares = padded[reach : reach + height]
        """Input values (rows, columns)."""
        self._buffer = buffer.reshape(reach, -1, width)
        self._steps = np.broadcast_to(_SQUARED_OFFSETS[:reach], self._buffer.shape)
        if reuse:
            self._steps = self._steps.copy()  # adding a contiguous array takes half the time
        count, (row, column) = self._buffer.shape[1], padded.strides
        self._blocks = list[tuple[slice, Squares, Squares]]()
        for first in range(0, height, count):
            offset, shape = (first + reach) * row, (reach, min(count, height - first), width)
            below: Squares = np.ndarray(shape, np.uint16, padded, offset - row, (-row, row, column))
            above: Squares = np.ndarray(shape, np.uint16, padded, offset + row, (row, row, column))
            self._blocks.append((slice(first, first + shape[1]), below, above))

    def run(self, out: Squares) -> None:
        """Write the result into `out` (rows, columns)."""
        for rows, below, above in self._blocks:
            candidates, steps = self._buffer[:, : below.shape[1]], self._steps[:, : below.shape[1]]
            np.minimum(below, above, out=candidates)
            candidates += steps
            np.minimum(np.minimum.reduce(candidates, axis=0), self.values[rows], out=out[rows])


def squared_distance_blocks(marked: npt.NDArray[np.bool_]) -> Iterator[tuple[slice, npt.NDArray[np.signedinteger]]]:
    """Yield blocks of rows with the exact squared distance in cells to the nearest marked cell.

    At least one cell must be marked.
    """
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(~marked, return_distances=False, return_indices=True)
    kind = np.int32 if max(marked.shape) <= MAX_INT32_EDGE_CELLS else np.int64
    columns = np.arange(marked.shape[1], dtype=kind)
    for first in range(0, len(marked), ROWS_PER_BLOCK):
        rows = slice(first, min(first + ROWS_PER_BLOCK, len(marked)))
        up = row[rows].astype(kind, copy=False) - np.arange(rows.start, rows.stop, dtype=kind)[:, None]
        along = column[rows].astype(kind, copy=False) - columns
        up *= up
        along *= along
        up += along
        yield rows, up
