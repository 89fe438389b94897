"""Consistency of a localizer: whether its covariances match its errors.

NEES is the normalized estimation error squared of a belief. ANEES is the average NEES of several beliefs.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.records.trace import Trace
from simscen.core.statistics import chi2_quantile, nees_mean_bounds
from simscen.criteria.trace_signals.estimation_errors import DIMENSIONS, nees_samples

Interval = tuple[float, float] | None
"""Interval in which a value lies with 95 % probability; None if it is unknown."""
MIN_BUILDINGS = 3
"""Minimum number of buildings for `correlated_anees_bounds`."""


@dataclass(frozen=True)
class Consistency:
    """Average NEES (ANEES) of a localizer: 3 if its covariances match its errors.

    anees:           ANEES over all logs and all CHECK_TIMES_S of campaign.py
    bounds:          `correlated_anees_bounds`: interval of `anees` for a consistent localizer
    inside:          fraction of the errors within the 95 % ellipsoid of the covariance
    anees_by_time:   ANEES over all logs at each of CHECK_TIMES_S
    bounds_by_time:  `anees_bounds`: interval of each of `anees_by_time` for a consistent localizer
    """

    anees: float
    bounds: Interval
    inside: float
    anees_by_time: Sequence[float]
    bounds_by_time: tuple[float, float]


def nees_at(trace: Trace, seconds: float) -> float | None:
    """Return the NEES of the belief at this time of a run; None before the first belief and after the end."""
    samples, tick = nees_samples(trace), round(seconds * trace.tick_rate)
    if not len(samples) or tick < samples.ticks[0] or tick > trace.end:
        return None
    return float(samples.at(np.array([tick]))[0, 0])


def fraction_in_ellipsoid(values: Sequence[float]) -> float:
    """Return the fraction of NEES `values` up to the 95 % quantile of the chi-square distribution."""
    return float(np.mean(np.asarray(values) <= chi2_quantile(0.95, DIMENSIONS)))


def anees_bounds(runs: int) -> tuple[float, float]:
    """Return 95 % bounds of the ANEES of a consistent localizer over this number of independent runs."""
    return nees_mean_bounds(runs, DIMENSIONS, 0.95)


def correlated_anees_bounds(building_anees: Sequence[float]) -> Interval:
    """Return 95 % bounds of the mean ANEES of a consistent localizer whose NEES values correlate within a building.

    `building_anees` has the ANEES of each building. The bounds lie around 3, as far apart as the bounds of Student's t
    interval for the logarithm of the mean (delta method). Return None with fewer than MIN_BUILDINGS buildings, or if
    the mean is infinite or not positive.
    """
    count, mean = len(building_anees), float(np.mean(building_anees))
    if count < MIN_BUILDINGS or not 0.0 < mean < math.inf:
        return None
    from scipy.special import stdtrit

    error = float(np.std(building_anees, ddof=1)) / mean / math.sqrt(count)
    factor = math.exp(float(stdtrit(count - 1, 0.975)) * error)
    return DIMENSIONS / factor, DIMENSIONS * factor
