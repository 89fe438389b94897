"""Normalized estimation error squared: how large the error of a belief is, measured by its own covariance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Samples
from simscen.criteria.trace_signals.ground_truth import check_samples, truth

if TYPE_CHECKING:
    from simscen.core.records.trace import Trace

DIMENSIONS = 3
"""x, y and yaw: what NEES is on average when the covariance says the truth."""


def nees(error: Array, covariance: Array) -> Array:
    """e' P^-1 e of errors (n, 3) in m, m, rad and covariances given as xx, xy, xa, yy, ya, aa (n, 6).

    By Cholesky's decomposition, pivot by pivot; infinite where P is not positive definite, as that of a depleted
    particle set is: it claims to know a direction exactly. (filterpy's stats.NEES; Bar-Shalom, Li, Kirubarajan 2001,
    section 5.4.)
    """
    xx, xy, xa, yy, ya, aa = covariance.T
    x, y, yaw = error.T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        y_pivot = yy - xy * xy / xx
        slope = (ya - xy * xa / xx) / y_pivot
        yaw_pivot = aa - xa * xa / xx - slope * slope * y_pivot
        y_rest = y - xy / xx * x
        yaw_rest = yaw - xa / xx * x - slope * y_rest
        value = x * x / xx + y_rest * y_rest / y_pivot + yaw_rest * yaw_rest / yaw_pivot
    definite = (np.array([xx, y_pivot, yaw_pivot]) > 0).all(axis=0) & np.isfinite(value)
    answer: Array = np.where(definite, value, np.inf)
    return answer


def nees_samples(trace: Trace) -> Samples:
    """NEES (n, 1) of each belief against the truth at its tick; none without covariances."""
    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses) or belief.values.shape[1] < 9:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 1)))
    x, y = (np.interp(belief.ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(belief.ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    error = np.column_stack((belief.values[:, 0] - x, belief.values[:, 1] - y, wrap_array(belief.values[:, 2] - yaw)))
    return Samples(belief.ticks, nees(error, belief.values[:, 3:])[:, np.newaxis])
