"""Which samples a page keeps: all of a short run, fewer of a long one."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.records.trace import Ticks

Chosen = npt.NDArray[np.int64]


def evenly(number: int, most: int) -> Chosen:
    """At most `most` of so many things, evenly spread, the first and the last among them."""
    if number <= most:
        return np.arange(number)
    return np.unique(np.rint(np.linspace(0, number - 1, max(most, 1))).astype(np.int64))


def paced(ticks: Ticks, period: int) -> Chosen:
    """Samples that are at least `period` ticks apart, and the last before a pause: from there on nothing moved."""
    kept: list[int] = []
    last = None
    for k, tick in enumerate(ticks.tolist()):
        pause = k + 1 == len(ticks) or int(ticks[k + 1]) - tick > 2 * period
        if last is None or tick - last >= period or pause:
            kept.append(k)
            last = tick
    return np.array(kept, dtype=np.int64)


def with_extremes(values: Array, most: int) -> Chosen:
    """At most `most` samples, such that the least and the greatest of each stretch are among them."""
    if len(values) <= most:
        return np.arange(len(values))
    stretches = np.array_split(np.arange(len(values)), max(1, most // 2))
    chosen = [(s[int(np.argmin(values[s]))], s[int(np.argmax(values[s]))]) for s in stretches]
    return np.unique(np.array(chosen).ravel())
