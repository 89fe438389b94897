"""How far each cell of a grid is from the nearest marked one, a few rows at a time.

scipy would hold all of it several times over in double precision: 200 MB for a map of 100 x 100 m.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

ROWS = 64
WIDE = 30_000
"""Cells along an edge up to which squares of distances fit 32 bits, in which they take half the time."""


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
