"""The cells of a costmap in blocks: what is best or worst of each."""

from functools import reduce

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float32]


def pooled(cells: Numbers | npt.NDArray[np.bool_], factor: int, choice: np.ufunc, beyond: float) -> Numbers:
    """The one of each block of `factor` x `factor` cells that `choice` leaves; the last ones are filled up `beyond`."""
    height, width = (-(-side // factor) * factor for side in cells.shape)
    padded = np.full((height, width), beyond, dtype=np.float32)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    parts = [padded[row::factor, column::factor] for row in range(factor) for column in range(factor)]
    left: Numbers = reduce(choice, parts)
    return left


def roomiest(room: Numbers, blocks: npt.NDArray[np.int64], factor: int) -> tuple[npt.NDArray[np.int64], ...]:
    """Row and column of the cell with most room in each of the blocks (n, 2)."""
    inner = np.arange(factor)
    rows = np.minimum(blocks[:, 0, None] * factor + np.repeat(inner, factor), room.shape[0] - 1)
    columns = np.minimum(blocks[:, 1, None] * factor + np.tile(inner, factor), room.shape[1] - 1)
    best = room[rows, columns].argmax(axis=1)
    which = np.arange(len(blocks))
    return rows[which, best], columns[which, best]
