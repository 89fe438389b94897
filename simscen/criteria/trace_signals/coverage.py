"""Whether the signals of a trace cover the whole run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.evidence import Evidence
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.trace_signals.ground_truth import check_finite

if TYPE_CHECKING:
    from simscen.core.records.trace import Ticks, Trace

MAX_GAP_S = 1.0
"""Longest time without a sample of the truth; in a longer one, anything may have happened."""


def time_gaps(trace: Trace) -> dict[Evidence, str]:
    """Return the evidence that the trace holds only for a part of the run, each with the first gap.

    The truth and the clearance must have a sample at least every MAX_GAP_S, from the start of the run to its end.
    """
    gaps: dict[Evidence, str] = {}
    if gap := _first_gap(trace, trace.truth.ticks):
        gaps |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), f"the truth has no sample {gap}")
    if gap := _first_gap(trace, trace.clearance.ticks):
        gaps[Evidence.CLEARANCE] = f"the clearance has no sample {gap}"
    return gaps


def check_recorded_signals(trace: Trace) -> None:
    """Raise InvalidTrace if a signal that simscen recorded is not finite, or its ticks do not rise."""
    check_finite(trace)
    named = [("truth", trace.truth), ("clearance", trace.clearance), ("belief", trace.belief)]
    for name, samples in named:
        if (np.diff(samples.ticks) <= 0).any():
            at = trace.seconds(int(samples.ticks[int(np.argmax(np.diff(samples.ticks) <= 0))]))
            raise InvalidTrace(f"the samples of the {name} are not in the order of time after t = {at:.2f} s")


def _first_gap(trace: Trace, ticks: Ticks) -> str:
    """Return the first gap that is too long, in words; "" if there is none, or no sample at all."""
    if not len(ticks):
        return ""
    edges = np.concatenate(([0], ticks, [trace.end]))
    long = np.flatnonzero(np.diff(edges) > MAX_GAP_S * trace.tick_rate)
    if not len(long):
        return ""
    begin, end = edges[long[0]] / trace.tick_rate, edges[long[0] + 1] / trace.tick_rate
    return f"from t = {begin:.2f} s to {end:.2f} s"
