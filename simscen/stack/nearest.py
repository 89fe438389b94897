"""How far each cell of a grid is from the nearest marked one, a few rows at a time.

scipy would hold all of it several times over in double precision: 200 MB for a map of 100 x 100 m.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

ROWS = 64


def squared_cells(marked: npt.NDArray[np.bool_]) -> Iterator[tuple[slice, npt.NDArray[np.int64]]]:
    """Some rows, and their cells' exact squared distances in cells to the nearest marked cell, of which one must be."""
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(~marked, return_distances=False, return_indices=True)
    columns = np.arange(marked.shape[1])
    for first in range(0, len(marked), ROWS):
        rows = slice(first, min(first + ROWS, len(marked)))
        up = row[rows].astype(np.int64) - np.arange(rows.start, rows.stop)[:, None]
        along = column[rows].astype(np.int64) - columns
        yield rows, up * up + along * along
