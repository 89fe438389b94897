"""Temporal operators on robustness values, sampled at any times: how well a condition holds over a window.

The operators follow the quantitative semantics of Donzé and Maler 2010, over samples: `always` is the smallest and
`eventually` the largest value of the samples in the window; `until` is the best value over all samples at which
`release` may become true. Unlike rtamt, which passes vacuously beyond the end of a trace, each operator is evaluated
twice, with the worst and with the best continuation of the trace (Deshmukh et al. 2017, robust online monitoring). The
true value lies between these two results. If they have different signs, the condition is undecided.

Samples need not be evenly spaced. A window without a sample uses the newest sample before its end (sample and hold).
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

    `value_after_end` is the value assumed there: the worst or the best. `run_ended` is True if the run ended at the
    last sample, so that a window without an end stops there. It is False if the log is truncated and the run may have
    gone on.
    """

    value_after_end: float
    run_ended: bool


@dataclass(frozen=True, eq=False)
class SampleWindows:
    """The windows of all samples, as inclusive ranges of sample indices: `first` and `last` for each sample.

    `first` is the number of samples if the window begins after the last one. `past_end` is True where the window
    reaches beyond the last sample. `unbounded` windows last to the end of the run.
    """

    first: Indices
    last: Indices
    past_end: Flags
    unbounded: bool

    @classmethod
    def of_samples(cls, ticks: Ticks, period: int, begin: int, end: int | None) -> SampleWindows:
        """Return the windows from `begin` to `end` ticks after each sample; `period` is the usual spacing in ticks."""
        count = len(ticks)
        first = np.searchsorted(ticks, ticks + begin, side="left")
        if end is None:
            return cls(first, np.full(count, count - 1), np.zeros(count, dtype=bool), True)
        last = np.searchsorted(ticks, ticks + end, side="right") - 1
        # The next sample would come one period after the last one.
        past_end = ticks + end >= ticks[-1:] + period
        is_held = (last < first) & (first < count)
        return cls(np.where(is_held, last, first), last, past_end, False)


def always(values: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the smallest value in the window of each sample."""
    return -eventually(-values, windows, Continuation(-continuation.value_after_end, continuation.run_ended))


def eventually(values: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the largest value in the window of each sample."""
    largest = _range_maximum(values, windows.first, windows.last)
    open_end = windows.past_end | (windows.unbounded and not continuation.run_ended) | (windows.first >= len(values))
    values_in_window: Array = np.where(open_end, np.maximum(largest, continuation.value_after_end), largest)
    return values_in_window


def until(hold: Array, release: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the robustness of `hold` until `release` in the window of each sample.

    It is the minimum of three terms, which avoids a search over pairs of samples: (1) `release` becomes true somewhere
    in the window; (2) `hold` is true from now to the start of the window; (3) from the start of the window, `hold` is
    true until `release` is, which here may also be after the window.
    """
    count = len(hold)
    from_window = np.append(_unbounded_until(hold, release, windows, continuation), continuation.value_after_end)
    before = -_range_maximum(-hold, np.arange(count), np.minimum(windows.first, count) - 1)
    robustness: Array = np.minimum(from_window[np.minimum(windows.first, count)], before)
    return robustness if windows.unbounded else np.minimum(robustness, eventually(release, windows, continuation))


def _unbounded_until(hold: Array, release: Array, windows: SampleWindows, continuation: Continuation) -> Array:
    """Return the robustness without a window, computed backwards: released now, or held now and released later."""
    later = -math.inf if windows.unbounded and continuation.run_ended else continuation.value_after_end
    results = []
    for holds, releases in np.column_stack((hold, release))[::-1].tolist():
        later = max(releases, min(holds, later))
        results.append(later)
    return np.array(results[::-1])


def _range_maximum(values: Array, first: Indices, last: Indices) -> Array:
    """Return the maximum of values[first[k]] … values[last[k]] for each k; -inf for an empty range.

    Uses a sparse table: level j has the maximum of 2^j values from each index on, and two overlapping ranges of that
    length cover any other range.
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
