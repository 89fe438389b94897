"""Squared Euclidean distances of the cells of a grid to the nearest marked cell, exact up to a maximum distance.

Up to a few meters, comparing neighbors in 16-bit integers is faster than scipy's transform (see docs/design/speed.md).
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Squared = npt.NDArray[np.uint16]
"""Squared distances in cells², as 16-bit integers."""
OUT_OF_REACH = 65535
"""Maximum squared distance: the maximum of 16 bits."""
MAX_REACH_CELLS = 255
"""Maximum `reach` (distance up to which results are exact) whose square fits into 16 bits."""
MAX_COMPARED_CELLS = 60
"""Maximum `reach` for which comparing neighbors is faster than scipy's transform."""
BLOCK_SIZE = 150_000
"""Number of values that are compared at once, so that they fit into a processor cache."""


def squared_distances_within(marked: npt.NDArray[np.bool_], reach: int) -> Squared:
    """Return the squared distance in cells from each cell (rows, columns) to the nearest marked cell.

    Distances up to `reach` cells, but at most MAX_REACH_CELLS, are exact. For cells farther away, the result is
    reach² + 1, but at most OUT_OF_REACH.
    """
    has_marked_cells = bool(marked.any())
    if has_marked_cells and reach <= MAX_COMPARED_CELLS:
        return SquaredDistanceTransform(marked.shape, reach, reuse=False).transform(marked)
    beyond = min(reach * reach + 1, OUT_OF_REACH)
    result: Squared = np.full(marked.shape, beyond, np.uint16)
    if has_marked_cells:
        for rows, squared in squared_distance_blocks(marked):
            result[rows] = np.minimum(squared, beyond)
    return result


class SquaredDistanceTransform:
    """Computes the same as `squared_distances_within` for several grids of one shape, with buffers allocated once.

    The transform is separable. The first pass finds the nearest marked cell in the same row. The second pass compares
    the results of all rows within `reach`.
    """

    def __init__(self, shape: tuple[int, ...], reach: int, reuse: bool = True) -> None:
        """Allocate buffers for grids of a shape (rows, columns). `reuse`: optimize for more than one grid."""
        self._reach = reach
        if reach > MAX_COMPARED_CELLS:
            return
        rows, columns = shape
        block_rows, block_columns = (
            max(1, min(length, BLOCK_SIZE // (reach * other_length))) for length, other_length in (shape, shape[::-1])
        )
        buffer = np.empty(reach * max(block_rows * columns, block_columns * rows), dtype=np.uint16)
        # Both passes go along the first axis. Therefore, the first pass gets the transposed grid (columns, rows).
        self._along_rows = _Pass((columns, rows), reach, buffer[: reach * block_columns * rows], reuse)
        self._along_columns = _Pass((rows, columns), reach, buffer[: reach * block_rows * columns], reuse)
        self._squared: Squared = np.empty((rows, columns), dtype=np.uint16)

    def transform(self, marked: npt.NDArray[np.bool_]) -> Squared:
        """Return the squared distances (rows, columns) of a grid. The array is valid until the next call."""
        if self._reach > MAX_COMPARED_CELLS:
            return squared_distances_within(marked, self._reach)
        transposed = self._along_rows.values
        transposed.fill(self._reach * self._reach + 1)
        np.copyto(transposed, np.uint16(0), where=marked.T)
        self._along_rows.run(self._along_columns.values.T)
        self._along_columns.run(self._squared)
        return self._squared


class _Pass:
    """Pass along the first axis of a grid: each result is the minimum of (value + offset²) within `reach` cells.

    values:  input (n, m) of the pass, to be written by the caller
    """

    def __init__(self, shape: tuple[int, int], reach: int, buffer: Squared, reuse: bool) -> None:
        """Take the shape (n, m) of the grid, and a `buffer` for `reach` neighbors of each cell in a block of rows."""
        length, width = shape
        padded = np.full((length + 2 * reach, width), reach * reach + 1, dtype=np.uint16)
        self.values: Squared = padded[reach : reach + length]
        self._buffer = buffer.reshape(reach, -1, width)
        squared_offsets = (np.arange(1, reach + 1) ** 2).astype(np.uint16)[:, None, None]
        self._squared_offsets = np.broadcast_to(squared_offsets, self._buffer.shape)
        if reuse:
            self._squared_offsets = self._squared_offsets.copy()  # adding a contiguous array takes half the time
        block_length, (row, column) = self._buffer.shape[1], padded.strides
        self._blocks = list[tuple[slice, Squared, Squared]]()
        """Rows of each block, and views (reach, rows, m) of the values that are 1, 2, … rows before and after them."""
        for first in range(0, length, block_length):
            offset, view_shape = (first + reach) * row, (reach, min(block_length, length - first), width)
            before: Squared = np.ndarray(view_shape, np.uint16, padded, offset - row, (-row, row, column))
            after: Squared = np.ndarray(view_shape, np.uint16, padded, offset + row, (row, row, column))
            self._blocks.append((slice(first, first + view_shape[1]), before, after))

    def run(self, out: Squared) -> None:
        """Write the result into `out` (n, m)."""
        for rows, before, after in self._blocks:
            candidates, offsets = self._buffer[:, : before.shape[1]], self._squared_offsets[:, : before.shape[1]]
            np.minimum(before, after, out=candidates)
            candidates += offsets
            np.minimum(np.minimum.reduce(candidates, axis=0), self.values[rows], out=out[rows])


ROWS_PER_BLOCK = 64
"""Number of rows of a block of `squared_distance_blocks`."""
MAX_INT32_EDGE_CELLS = 30_000
"""Maximum edge length of a grid for which squared distances fit into 32 bits."""


def squared_distance_blocks(marked: npt.NDArray[np.bool_]) -> Iterator[tuple[slice, npt.NDArray[np.signedinteger]]]:
    """Yield blocks of rows with exact squared distances in cells to the nearest marked cell, at any distance.

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
