"""Whether a localizer is as sure as it may be: normalized estimation error squared, averaged over runs.

The average is over runs at fixed times, not over time: errors of one run are correlated, and the bounds of the
chi-square distribution hold for independent samples only. (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.) Runs that
share a building are not independent either: what stands elsewhere than the map shows it errs in all of them.
"""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.trace import Trace
from simscen.core.statistics import chi2_quantile, nees_mean_bounds
from simscen.criteria.trace_signals.ground_truth import DIMENSIONS, nees_samples
from simscen.criteria.trace_signals.ground_truth import nees as squared_errors

FEWEST = 3
"""Buildings from which on they say how much they differ."""


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


def within_bounds(values: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95) -> float:
    """The share of NEES of errors that lie in the ellipsoid in which normal ones do with this probability."""
    return float(np.mean(np.asarray(values) <= chi2_quantile(probability, dimensions)))


def bounds(runs: int, dimensions: int = DIMENSIONS, probability: float = 0.95) -> tuple[float, float]:
    """Between which ANEES lies with this probability when the localizer is consistent: chi2(d N) / N."""
    return nees_mean_bounds(runs, dimensions, probability)


def bounds_over(
    groups: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95
) -> tuple[float, float] | None:
    """Between which the mean of `groups` lies with this probability when the covariance is right on average.

    `groups` are the ANEES of buildings, as many values in each: within one they may depend on each other in any way,
    along a log and from log to log, and have any distribution. Nothing but how much buildings differ tells how far off
    the mean may be; of its logarithm, for it is a scale: t times the relative standard error (delta method), with one
    degree of freedom less than there are buildings. None for fewer than three, or where a value is infinite.
    """
    count, mean = len(groups), float(np.mean(groups))
    if count < FEWEST or not 0.0 < mean < math.inf:
        return None
    from scipy.special import stdtrit

    error = float(np.std(groups, ddof=1)) / mean / math.sqrt(count)
    factor = math.exp(float(stdtrit(count - 1, (1.0 + probability) / 2.0)) * error)
    return dimensions / factor, dimensions * factor
