"""How far each cell of a grid is from the nearest marked one, a few rows at a time.

scipy would hold all of it several times over in double precision: 200 MB for a map of 100 x 100 m. It takes 0.3 s for
that; where nobody asks beyond 2 m, going over rows and columns in bytes takes 0.1 s, and 0.05 s for 0.7 m.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

ROWS = 64
WIDE = 30_000
"""Cells along an edge up to which squares of distances fit 32 bits, in which they take half the time."""

FARTHEST = 180
"""Cells: the longest reach whose squares, added along both axes, fit 16 bits."""
BEYOND = 65535
"""What stands for every distance beyond the reach that was asked for."""

Bytes = npt.NDArray[np.uint8]
Squares = npt.NDArray[np.uint16]


def squared_within(marked: npt.NDArray[np.bool_], reach: int) -> Iterator[tuple[slice, Squares]]:
    """Some rows, and their cells' exact squared distances in cells to the nearest marked cell, up to `reach` cells.

    Farther cells have BEYOND. `reach` is FARTHEST at most.
    """
    rises, most = _along_columns(marked, reach), np.uint16(reach * reach)
    squares = np.minimum(np.square(np.arange(256, dtype=np.uint32)), most + 1).astype(np.uint16)
    for first in range(0, len(marked), ROWS):
        rows = slice(first, min(first + ROWS, len(marked)))
        up = squares.take(rises[rows])
        squared, moved = up.copy(), np.empty_like(up)
        for across in range(1, min(reach, marked.shape[1] - 1) + 1):
            np.add(up, across * across, out=moved)
            np.minimum(squared[:, across:], moved[:, :-across], out=squared[:, across:])
            np.minimum(squared[:, :-across], moved[:, across:], out=squared[:, :-across])
        squared[squared > most] = BEYOND
        yield rows, squared


def _along_columns(marked: npt.NDArray[np.bool_], reach: int) -> Bytes:
    """How many cells up or down the nearest marked cell of the same column is; more than `reach` where none is."""
    free, farther = (~marked).view(np.uint8), reach + 1
    away = np.empty(marked.shape, dtype=np.uint8)
    before: Bytes = np.full(marked.shape[1], farther, dtype=np.uint8)
    for row, open_ in zip(away, free, strict=True):
        np.multiply(np.minimum(before + np.uint8(1), farther), open_, out=row)
        before = row
    before = np.full(marked.shape[1], farther, dtype=np.uint8)
    for row in away[::-1]:
        np.minimum(before + np.uint8(1), row, out=row)
        before = row
    return away


def squared_cells(marked: npt.NDArray[np.bool_]) -> Iterator[tuple[slice, npt.NDArray[np.signedinteger]]]:
    """Some rows, and their cells' exact squared distances in cells to the nearest marked cell, of which one must be."""
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(~marked, return_distances=False, return_indices=True)
    kind = np.int32 if max(marked.shape) <= WIDE else np.int64
    columns = np.arange(marked.shape[1], dtype=kind)
    for first in range(0, len(marked), ROWS):
        rows = slice(first, min(first + ROWS, len(marked)))
        up = row[rows].astype(kind, copy=False) - np.arange(rows.start, rows.stop, dtype=kind)[:, None]
        along = column[rows].astype(kind, copy=False) - columns
        up *= up
        along *= along
        up += along
        yield rows, up
