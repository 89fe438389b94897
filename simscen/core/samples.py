"""A signal over the ticks of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array

if TYPE_CHECKING:
    import numpy.typing as npt

    Ticks = npt.NDArray[np.int64]
else:
    Ticks = object  # annotations are not evaluated; commands that only read files need no numpy


@dataclass(frozen=True, eq=False)
class Samples:
    """A signal: `ticks` (n,) ascending, `values` (n, k)."""

    ticks: Ticks
    values: Array

    def __len__(self) -> int:
        return len(self.ticks)

    def at(self, ticks: Ticks) -> Array:
        """The newest value at each of `ticks` (sample and hold); the first value before the first sample."""
        return self.values[np.maximum(np.searchsorted(self.ticks, ticks, side="right") - 1, 0)]
