"""Temporal operators on robustness signals: how well a condition holds over a window, at every sample, in O(n).

The quantitative semantics of Donzé and Maler 2010 in discrete time, as rtamt has it: always is the least, eventually
the greatest value in the window, until the best of its releases. Where rtamt passes vacuously beyond the end of a
trace, each operator here is evaluated twice, with the worst and with the best continuation (Deshmukh et al. 2017,
robust online monitoring): the truth lies between, and as long as the two disagree nothing is decided.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array


class SampleWindow(NamedTuple):
    """From `first` to `last` samples ahead, both included; None = to the end of the run."""

    first: int
    last: int | None


class Continuation(NamedTuple):
    """What is taken for granted beyond the last sample: `worst` or `best`, and whether the run is over there.

    Of a run that is over, a window without an end closes at its last sample; of a log that was cut off it does not.
    """

    beyond: float
    over: bool


def always(values: Array, window: SampleWindow, ahead: Continuation) -> Array:
    """The least value in the window of each sample."""
    return -eventually(-values, window, Continuation(-ahead.beyond, ahead.over))


def eventually(values: Array, window: SampleWindow, ahead: Continuation) -> Array:
    """The greatest value in the window of each sample."""
    if window.last is None and ahead.over:
        return _shifted(np.maximum.accumulate(values[::-1])[::-1], window.first, ahead.beyond)
    first = min(window.first, len(values))
    last = len(values) if window.last is None else min(window.last, len(values))
    return _greatest(np.concatenate((values, np.full(last, ahead.beyond))), first, last - first + 1, len(values))


def until(hold: Array, release: Array, window: SampleWindow, ahead: Continuation) -> Array:
    """How well `hold` holds from each sample on until `release` does, in its window.

    By an identity that needs no look at every pair of samples: something releases in the window, `hold` holds up to
    the window, and from there it is released at some time, be it after the window.
    """
    released = _shifted(_unbounded(hold, release, window, ahead), window.first, ahead.beyond)
    if window.first > 0:
        released = np.minimum(released, always(hold, SampleWindow(0, window.first - 1), ahead))
    if window.last is not None:
        released = np.minimum(released, eventually(release, window, ahead))
    return released


def _unbounded(hold: Array, release: Array, window: SampleWindow, ahead: Continuation) -> Array:
    """From the last sample backwards: released now, or held now and released later."""
    later = -math.inf if window.last is None and ahead.over else ahead.beyond
    answers = []
    for held, freed in np.column_stack((hold, release))[::-1].tolist():
        later = max(freed, min(held, later))
        answers.append(later)
    return np.array(answers[::-1])


def _shifted(values: Array, by: int, beyond: float) -> Array:
    """The value `by` samples ahead."""
    by = min(by, len(values))
    return np.concatenate((values[by:], np.full(by, beyond)))


def _greatest(values: Array, first: int, width: int, count: int) -> Array:
    """The greatest of `width` values from `first` + k on, for k < `count`: three passes, whatever the width.

    A window reaches over the border of at most two blocks of its width: what is left of the one and the beginning of
    the other. (van Herk 1992; Gil and Werman 1993.)
    """
    blocks = np.pad(values, (0, -len(values) % width)).reshape(-1, width)  # what is added is in no window
    begun = np.maximum.accumulate(blocks, axis=1).ravel()
    left = np.maximum.accumulate(blocks[:, ::-1], axis=1)[:, ::-1].ravel()
    greatest: Array = np.maximum(left[first : first + count], begun[first + width - 1 : first + width - 1 + count])
    return greatest
