"""Sampling of signals: their common clock, sample and hold of slower signals, and resampling of uneven ones.

A signal has one value for each sample of the truth, whenever it was taken.

- Signals that are published more rarely (belief, command, scans) keep their newest value until the next one. Before the
  first value, the first value counts.
- Events between two samples count at the sample that follows.
- Differences over time (acceleration, jerk, SPARC, LDLJ) need even samples. Uneven samples of the truth are resampled
  to their median spacing by linear interpolation. Across a gap longer than MAX_INTERPOLATED_GAP_S, the signal is
  unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.trace import Samples, Ticks

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Ticks, Trace


MAX_INTERPOLATED_GAP_S = 0.25
"""Longest gap across which uneven samples are interpolated."""

SignalArguments = Mapping[str, object]
"""Arguments of a signal: object, point, goal, region, fault, event, recovery or with, as the condition names them."""


class SignalUnavailable(ValueError):
    """The trace lacks the data of a signal, so that nothing can be decided; the message says what is missing."""


@dataclass(frozen=True, eq=False)
class SignalQuery:
    """A run, and the arguments of the signal that is read from it."""

    trace: Trace
    case: Case
    arguments: SignalArguments


def sample_ticks(trace: Trace) -> Ticks:
    """Return the ticks at which signals have values: those of the truth. Raises SignalUnavailable without a truth."""
    if not len(trace.truth):
        raise SignalUnavailable("the true pose was not recorded")
    return trace.truth.ticks


def hold(trace: Trace, samples: Samples, what: str) -> Array:
    """Return the newest value at each sample of the truth. Raises SignalUnavailable without any value."""
    ticks = sample_ticks(trace)
    if not len(samples):
        raise SignalUnavailable(f"no {what} was recorded")
    return samples.at(ticks)


def usual_period(ticks: Ticks) -> int:
    """Return the median spacing of samples in ticks, at least 1."""
    return max(1, int(np.median(np.diff(ticks)))) if len(ticks) > 1 else 1


def evenly_spaced(samples: Samples, tick_rate: int) -> Samples:
    """Return the samples themselves if they are evenly spaced, else resampled to their median spacing.

    Raises SignalUnavailable if there are fewer than two, if their ticks do not increase, or if a gap is too long for
    interpolation.
    """
    if len(samples) < 2:
        raise SignalUnavailable(f"the run is too short: {_samples(len(samples))} of the truth")
    ticks, steps = samples.ticks, np.diff(samples.ticks)
    if (steps <= 0).any():
        raise SignalUnavailable("the samples of the truth are not in chronological order")
    if (steps == steps[0]).all():
        return samples
    longest = int(np.argmax(steps))
    if steps[longest] > MAX_INTERPOLATED_GAP_S * tick_rate:
        begin, end = ticks[longest] / tick_rate, ticks[longest + 1] / tick_rate
        raise SignalUnavailable(
            f"the truth has no sample from t = {begin:.2f} s to {end:.2f} s; differences over time need one every "
            f"{MAX_INTERPOLATED_GAP_S:g} s"
        )
    grid = np.arange(ticks[0], ticks[-1] + 1, usual_period(ticks))
    return Samples(grid, np.column_stack([np.interp(grid, ticks, column) for column in samples.values.T]))


def _samples(count: int) -> str:
    return "1 sample" if count == 1 else f"{count} samples"
