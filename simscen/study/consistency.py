"""Whether a localizer is as sure as it may be: normalised estimation error squared, averaged over runs.

The average is over runs at fixed times, not over time: errors of one run are correlated, and the bounds of the
chi-square distribution hold for independent samples only. (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.)
"""

from collections.abc import Sequence

import numpy as np

from simscen.core.chisquare import mean_bounds
from simscen.core.geometry import Array
from simscen.core.trace import Trace
from simscen.criteria.nees import DIMENSIONS, nees_samples
from simscen.criteria.nees import nees as squared_errors


def nees(error: Array, covariance: Array) -> float:
    """e' P^-1 e of an error (3,) in m, m, rad with covariance P (3, 3); inf where P is singular."""
    return float(squared_errors(error[np.newaxis], covariance[np.triu_indices(3)][np.newaxis])[0])


def nees_at(trace: Trace, seconds: float) -> float | None:
    """The belief's NEES at a time of a run; None before the first belief and after the end."""
    samples, tick = nees_samples(trace), round(seconds * trace.tick_rate)
    if not len(samples) or tick < samples.ticks[0] or tick > trace.end:
        return None
    return float(samples.at(np.array([tick]))[0, 0])


def anees(values: Sequence[float]) -> float:
    """The average of one NEES from each run, 3 for a consistent localizer in the plane."""
    return float(np.mean(values))


def bounds(runs: int, dimensions: int = DIMENSIONS, probability: float = 0.95) -> tuple[float, float]:
    """Between which ANEES lies with this probability when the localizer is consistent: chi2(d N) / N."""
    return mean_bounds(runs, dimensions, probability)
