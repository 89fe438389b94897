"""Checks of the samples of a whole trace for long gaps, chronological order, and values that are not finite."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.verdict import Evidence
from simscen.criteria.trace_signals.ground_truth import check_samples, clearance, reject_samples, speed, truth

if TYPE_CHECKING:
    from simscen.core.records.trace import Ticks, Trace

MAX_GAP_S = 1.0
"""Longest gap between samples that `time_gaps` tolerates."""


def time_gaps(trace: Trace) -> dict[Evidence, str]:
    """Return a description of the first gap, by kind of evidence. Evidence without gaps is left out.

    A gap is a time longer than MAX_GAP_S without a sample of the truth or of the clearance.
    """
    gaps: dict[Evidence, str] = {}
    if gap := _first_gap(trace, trace.truth.ticks):
        gaps |= dict.fromkeys((Evidence.TRUTH, Evidence.VELOCITY), f"the truth has no sample {gap}")
    if gap := _first_gap(trace, trace.clearance.ticks):
        gaps[Evidence.CLEARANCE] = f"the clearance has no sample {gap}"
    return gaps


def check_recorded_signals(trace: Trace) -> None:
    """Raise InvalidTrace if a signal of a log of simscen is not finite, or if ticks do not increase.

    Ticks are checked for truth, clearance, and belief. An infinite clearance is allowed. Odometry is not checked,
    because a fault can corrupt it.
    """
    truth(trace), speed(trace), clearance(trace)
    check_samples(trace.belief, "the belief", trace)
    check_samples(trace.command, "the command", trace)
    for name, poses in sorted(trace.objects.items()):
        check_samples(poses, f"the pose of {name}", trace)
    named = [("truth", trace.truth), ("clearance", trace.clearance), ("belief", trace.belief)]
    for name, samples in named:
        problem = f"the samples of the {name} are not in chronological order after"
        reject_samples(trace, samples.ticks, np.diff(samples.ticks) <= 0, problem)


def _first_gap(trace: Trace, ticks: Ticks) -> str:
    """Return the first gap longer than MAX_GAP_S as text; "" if there is none, or if there are no samples."""
    if not len(ticks):
        return ""
    edges = np.concatenate(([0], ticks, [trace.end]))
    long = np.flatnonzero(np.diff(edges) > MAX_GAP_S * trace.tick_rate)
    if not len(long):
        return ""
    begin, end = edges[long[0]] / trace.tick_rate, edges[long[0] + 1] / trace.tick_rate
    return f"from t = {begin:.2f} s to {end:.2f} s"
