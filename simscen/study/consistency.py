"""Whether a localizer is as sure as it may be: normalised estimation error squared, averaged over runs.

The average is over runs at fixed times, not over time: errors of one run are correlated, and the bounds of the
chi-square distribution hold for independent samples only. (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.)
"""

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, wrap
from simscen.core.trace import Trace

DIMENSIONS = 3


def nees(error: Array, covariance: Array) -> float:
    """e' P^-1 e of an error (3,) in m, m, rad with covariance P (3, 3); inf where P is singular."""
    if np.linalg.eigvalsh(covariance)[0] <= 0.0:
        return float("inf")
    return float(error @ np.linalg.solve(covariance, error))


def nees_at(trace: Trace, seconds: float) -> float | None:
    """The belief's NEES at a time of a run; None before the first belief and after the end."""
    belief, tick = trace.belief, round(seconds * trace.tick_rate)
    index = int(np.searchsorted(belief.ticks, tick, side="right")) - 1
    if index < 0 or tick > trace.end:
        return None
    when = int(belief.ticks[index])
    x, y, yaw, xx, xy, xa, yy, ya, aa = belief.values[index].tolist()
    true_x, true_y, true_yaw = trace.truth.at(np.array([when]))[0].tolist()
    error = np.array([x - true_x, y - true_y, wrap(yaw - true_yaw)])
    return nees(error, np.array([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]]))


def anees(values: Sequence[float]) -> float:
    """The average of one NEES from each run, 3 for a consistent localizer in the plane."""
    return float(np.mean(values))


def bounds(runs: int, dimensions: int = DIMENSIONS, probability: float = 0.95) -> tuple[float, float]:
    """Between which ANEES lies with this probability when the localizer is consistent: chi2(d N) / N."""
    from scipy.stats import chi2

    tail = (1.0 - probability) / 2.0
    freedom = dimensions * runs
    return float(chi2.ppf(tail, freedom)) / runs, float(chi2.ppf(1.0 - tail, freedom)) / runs
