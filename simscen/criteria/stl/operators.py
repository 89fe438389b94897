"""Temporal operators of signal temporal logic (STL) on sampled robustness values.

The robustness of a condition is the margin by which it is true; negative if the condition is false. The operators
follow Donzé and Maler 2010: `always` is the smallest, and `eventually` the largest robustness in the window.

A window can extend beyond the last sample. Therefore, each operator is evaluated with the worst and with the best
assumption about the time after the last sample (Deshmukh et al. 2017, robust online monitoring). If the results have
different signs, the condition is undecided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from simscen.core.geometry import Array

if TYPE_CHECKING:
    import numpy.typing as npt

    from simscen.core.records.trace import Ticks

    Indices = npt.NDArray[np.int64]
    Flags = npt.NDArray[np.bool_]


class Continuation(NamedTuple):
    """Assumption about the time after the last sample.

    `value_after_end` is the robustness in this time: the worst or the best one. `run_ended` is True if the run ended at
    the last sample, and False for a truncated log.
    """

    value_after_end: float
    run_ended: bool


@dataclass(frozen=True, eq=False)
class SampleWindows:
    """Window of each of n samples: the index `first` and the index `last` of a sample (n,), both inclusive.

    `first` is n if the window begins after the last sample. `extends_past_end` (n,) is True if the window extends
    beyond the last sample. If `is_unbounded`, all windows last to the end of the run.
    """

    first: Indices
    last: Indices
    extends_past_end: Flags
    is_unbounded: bool

    @classmethod
    def of_samples(cls, ticks: Ticks, period: int, begin: int, end: int | None) -> SampleWindows:
        """Return the windows from `begin` to `end` ticks after each sample. An end of None is the end of the run.

        `period` is the usual spacing of samples in ticks. A window between two samples contains the earlier sample.
        """
        count = len(ticks)
        first = np.searchsorted(ticks, ticks + begin, side="left")
        if end is None:
            return cls(first, np.full(count, count - 1), np.zeros(count, dtype=bool), True)
        last = np.searchsorted(ticks, ticks + end, side="right") - 1
        # The next sample would come one period after the last one.
        extends_past_end = ticks + end >= ticks[-1:] + period
        is_between_samples = (last < first) & (first < count)
        return cls(np.where(is_between_samples, last, first), last, extends_past_end, False)


def always(values: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the smallest of the values (n,) in the window of each sample."""
    return -eventually(-values, windows, Continuation(-continuation.value_after_end, continuation.run_ended))


def eventually(values: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the largest of the values (n,) in the window of each sample."""
    largest = _range_maximum(values, windows.first, windows.last)
    may_grow = windows.is_unbounded and not continuation.run_ended
    has_open_end = windows.extends_past_end | may_grow | (windows.first >= len(values))
    result: Array = np.where(has_open_end, np.maximum(largest, continuation.value_after_end), largest)
    return result


def until(hold: Array, release: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the robustness (n,) of the condition that `hold` is true until `release` becomes true in the window.

    `hold` and `release` are the robustness (n,) of two conditions.
    """
    # Smallest robustness of three conditions: `release` becomes true in the window, `hold` is true before the window,
    # and from the window on, `hold` is true until `release` becomes true at any time.
    count = len(hold)
    from_window = np.append(_unbounded_until(hold, release, windows, continuation), continuation.value_after_end)
    before = -_range_maximum(-hold, np.arange(count), np.minimum(windows.first, count) - 1)
    robustness: Array = np.minimum(from_window[np.minimum(windows.first, count)], before)
    return robustness if windows.is_unbounded else np.minimum(robustness, eventually(release, windows, continuation))


def _unbounded_until(hold: Array, release: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the robustness (n,) of `until` from each sample on, if `release` may become true at any later time."""
    later = -math.inf if windows.is_unbounded and continuation.run_ended else continuation.value_after_end
    results = []
    for holds, releases in np.column_stack((hold, release))[::-1].tolist():
        later = max(releases, min(holds, later))
        results.append(later)
    return np.array(results[::-1])


def _range_maximum(values: Array, first: Indices, last: Indices) -> Array:
    """Return the maximum of values[first[k]] … values[last[k]] for each k; -inf for an empty range.

    The method is a sparse table: level j contains, for each index, the maximum of the 2^j values that begin there.
    """
    widths = last - first + 1
    found = np.full(len(first), -np.inf)
    level, table = 0, np.asarray(values, dtype=np.float64)
    while True:
        length = 1 << level
        is_level = (widths >= length) & (widths < 2 * length)
        if is_level.any():
            found[is_level] = np.maximum(table[first[is_level]], table[last[is_level] - length + 1])
        if not (widths >= 2 * length).any():
            return found
        table = np.maximum(table[:-length], table[length:])
        level += 1
