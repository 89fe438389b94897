"""Square blocks of grid cells: one value for each block, and its cell with the most clearance."""

from functools import reduce
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Scalar = TypeVar("Scalar", bound=np.generic)


def pool_blocks(cells: npt.NDArray[Scalar], factor: int, ufunc: np.ufunc, padding: float) -> npt.NDArray[Scalar]:
    """Reduce each block of `factor` x `factor` cells to one value with a ufunc such as np.maximum.

    Incomplete blocks at the end are filled up with `padding`.
    """
    height, width = (-(-side // factor) * factor for side in cells.shape)
    padded = np.full((height, width), padding, dtype=cells.dtype)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    pooled: npt.NDArray[Scalar] = reduce(
        ufunc, [padded[row::factor, column::factor] for row in range(factor) for column in range(factor)]
    )
    return pooled


def cells_with_most_clearance(
    clearance: npt.NDArray[np.float32], blocks: npt.NDArray[np.int64], factor: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the rows (n,) and columns (n,) of the cells with the most clearance in blocks (n, 2: row, column).

    A block consists of `factor` x `factor` cells.
    """
    inner = np.arange(factor)
    rows = np.minimum(blocks[:, 0, None] * factor + np.repeat(inner, factor), clearance.shape[0] - 1)
    columns = np.minimum(blocks[:, 1, None] * factor + np.tile(inner, factor), clearance.shape[1] - 1)
    best = clearance[rows, columns].argmax(axis=1)
    indices = np.arange(len(blocks))
    return rows[indices, best], columns[indices, best]
