"""Smoothness of a speed profile: spectral arc length (SPARC) and log dimensionless jerk (LDLJ).

Source: Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet 2015, "On the analysis of movement smoothness", and the
authors' own code (siva82kb/SPARC).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.ground_truth import speed
from simscen.criteria.trace_signals.sampling import evenly_spaced

if TYPE_CHECKING:
    from simscen.core.records.trace import Trace

MIN_MOVING_SPEED_M_S = 0.01
"""Minimum speed of a moving robot. Lower speeds are noise."""

CUTOFF_HZ = 10.0
"""Maximum frequency of the spectrum that SPARC uses. Higher frequencies are noise."""
MIN_RATE_HZ = 18.0
"""Minimum sample rate: twice the cutoff, with a tolerance of 10 % for jitter."""
MIN_RELATIVE_AMPLITUDE = 0.05
"""Minimum amplitude, relative to the largest one, at both ends of the spectrum that SPARC uses."""
PADDING_LEVEL = 4
"""Exponent of the factor 2^PADDING_LEVEL by which SPARC lengthens a speed profile with zeros, for a finer spectrum."""


def evenly_sampled_speed(trace: Trace) -> tuple[Array, float]:
    """Return the true speed over ground (m,) in m/s, sampled at evenly spaced times, and the sample rate in Hz.

    Raises MissingEvidence if there is no velocity, or if the sample rate is too low for SPARC and LDLJ.
    """
    even = evenly_spaced(speed(trace), trace.tick_rate)
    rate = trace.tick_rate / float(even.ticks[1] - even.ticks[0])
    if rate < MIN_RATE_HZ:
        raise MissingEvidence(f"the truth has {rate:.1f} samples a second, too few for changes up to {CUTOFF_HZ:g} Hz")
    return even.values[:, 0], rate


def sparc(speeds: Array, rate: float) -> float | None:
    """Return the spectral arc length of `speeds` (n,) in m/s, sampled at `rate` Hz: 0 is smooth, lower is less smooth.

    Return None for a robot that never moved, or if there are too few samples.
    """
    if len(speeds) < 2 or not np.any(speeds):
        return None
    padded_length = 2 ** (math.ceil(math.log2(len(speeds))) + PADDING_LEVEL)
    amplitudes = np.abs(np.fft.rfft(speeds, padded_length))
    amplitudes = amplitudes / amplitudes.max()
    frequencies = np.arange(len(amplitudes)) * (rate / padded_length)
    significant = np.flatnonzero((amplitudes >= MIN_RELATIVE_AMPLITUDE) & (frequencies <= CUTOFF_HZ))
    selected = slice(int(significant[0]), int(significant[-1]) + 1)
    band, heights = frequencies[selected], amplitudes[selected]
    if len(band) < 2:
        return None
    steps = np.diff(band) / (band[-1] - band[0])
    return -float(np.sqrt(steps**2 + np.diff(heights) ** 2).sum())


def ldlj(speeds: Array, rate: float) -> float | None:
    """Return the log dimensionless jerk of `speeds` (n,) in m/s, sampled at `rate` Hz; larger is smoother.

    The formula is -ln(T^3 / v_max^2 * sum(jerk^2) dt), with the duration T and the top speed v_max. Return None for a
    robot that never moved, or whose acceleration never changed.
    """
    if not np.any(speeds):
        return None
    dt = 1.0 / rate
    jerk = np.diff(speeds, 2) / dt**2
    duration, peak = len(speeds) * dt, float(np.abs(speeds).max())
    dimensionless = duration**3 / peak**2 * float((jerk**2).sum()) * dt
    return -math.log(dimensionless) if dimensionless > 0 else None
