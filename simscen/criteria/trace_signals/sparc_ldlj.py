"""How smooth a speed profile is, in one number: SPARC and LDLJ.

Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet 2015, "On the analysis of movement smoothness", and the authors'
own code (siva82kb/SPARC), whose doctests are ours. Neither sees all: SPARC hardly notices a stop on the way, LDLJ
hardly a slow wobble; and both drift with the duration, so compare only drives of the same way.
"""

from __future__ import annotations

import math

import numpy as np

from simscen.core.geometry import Array

MOVED_SPEED_M_S = 0.01
"""m/s; a robot that was never faster did not move, and what it did is noise."""

CUTOFF_HZ = 10.0
"""Hz; faster changes of speed are noise."""
MIN_RELATIVE_AMPLITUDE = 0.05
"""Of the greatest; where the spectrum is lower at both ends, it is cut off."""
PADDING_LEVEL = 4
"""The spectrum is that of a profile with zeros behind, 2^4 times as long, which makes it finer."""


def sparc(speeds: Array, rate: float) -> float | None:
    """Spectral arc length of speeds (n,) sampled `rate` times a second; 0 = smooth, never above.

    None where it is not defined: for a robot that never moved.
    """
    if len(speeds) < 2 or not np.any(speeds):
        return None
    padded = 2 ** (math.ceil(math.log2(len(speeds))) + PADDING_LEVEL)
    amplitudes = np.abs(np.fft.rfft(speeds, padded))
    amplitudes = amplitudes / amplitudes.max()
    frequencies = np.arange(len(amplitudes)) * (rate / padded)
    loud = np.flatnonzero((amplitudes >= MIN_RELATIVE_AMPLITUDE) & (frequencies <= CUTOFF_HZ))
    kept = slice(int(loud[0]), int(loud[-1]) + 1)
    band, heights = frequencies[kept], amplitudes[kept]
    if len(band) < 2:
        return None
    steps = np.diff(band) / (band[-1] - band[0])
    return -float(np.sqrt(steps**2 + np.diff(heights) ** 2).sum())


def ldlj(speeds: Array, rate: float) -> float | None:
    """Log dimensionless jerk, -ln(T^3 / v_max^2 * sum(jerk^2) dt), of speeds (n,) at `rate`; greater = smoother.

    None where it is not defined: for a robot that never moved, or whose speed never changed its slope.
    """
    if not np.any(speeds):
        return None
    dt = 1.0 / rate
    jerk = np.diff(speeds, 2) / dt**2
    duration, peak = len(speeds) * dt, float(np.abs(speeds).max())
    dimensionless = duration**3 / peak**2 * float((jerk**2).sum()) * dt
    return -math.log(dimensionless) if dimensionless > 0 else None
