"""Sampling of signals: each signal has one value for each sample of the truth (the recorded true poses)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.trace import Samples
from simscen.criteria.findings import MissingEvidence

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Ticks, Trace


MAX_INTERPOLATED_GAP_S = 0.25
"""Longest gap between samples that `evenly_spaced` interpolates."""

SignalArguments = Mapping[str, object]
"""Arguments of a signal by YAML key: `object`, `point`, `goal`, `region`, `fault`, `event`, `recovery`,
or `with`."""


@dataclass(frozen=True, eq=False)
class SignalQuery:
    """Input of a function that computes a signal: the trace and the case of a run, and the arguments of the signal."""

    trace: Trace
    case: Case
    arguments: SignalArguments


def sample_ticks(trace: Trace) -> Ticks:
    """Return the ticks of the samples of the truth. Raises MissingEvidence if there are none."""
    if not len(trace.truth):
        raise MissingEvidence("the true pose was not recorded")
    return trace.truth.ticks


def sample_and_hold(trace: Trace, samples: Samples, what: str) -> Array:
    """Return the newest values (n, k) of `samples` at each sample of the truth.

    Raises MissingEvidence if `samples` are empty; `what` is the name of the signal in the message.
    """
    ticks = sample_ticks(trace)
    if not len(samples):
        raise MissingEvidence(f"no {what} was recorded")
    return samples.at(ticks)


def usual_period(ticks: Ticks) -> int:
    """Return the median spacing of samples in ticks, at least 1."""
    return max(1, int(np.median(np.diff(ticks)))) if len(ticks) > 1 else 1


def evenly_spaced(samples: Samples, tick_rate: int) -> Samples:
    """Return the samples, resampled to their median spacing by linear interpolation unless they are evenly spaced.

    Raises MissingEvidence if there are fewer than two samples, if their ticks do not increase, or if a gap is longer
    than MAX_INTERPOLATED_GAP_S.
    """
    if len(samples) < 2:
        raise MissingEvidence(f"the run is too short: {len(samples)} sample{'s' * (len(samples) != 1)} of the truth")
    ticks, steps = samples.ticks, np.diff(samples.ticks)
    if (steps <= 0).any():
        raise MissingEvidence("the samples of the truth are not in chronological order")
    if (steps == steps[0]).all():
        return samples
    longest = int(np.argmax(steps))
    if steps[longest] > MAX_INTERPOLATED_GAP_S * tick_rate:
        begin, end = ticks[longest] / tick_rate, ticks[longest + 1] / tick_rate
        raise MissingEvidence(
            f"the truth has no sample from t = {begin:.2f} s to {end:.2f} s; differences over time need a sample every "
            f"{MAX_INTERPOLATED_GAP_S:g} s"
        )
    grid = np.arange(ticks[0], ticks[-1] + 1, usual_period(ticks))
    return Samples(grid, np.column_stack([np.interp(grid, ticks, column) for column in samples.values.T]))
