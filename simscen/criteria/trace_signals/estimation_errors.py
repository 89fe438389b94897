"""Errors of the estimated pose: distance and angle to the true pose, and NEES."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Samples
from simscen.criteria.trace_signals.ground_truth import check_samples, truth

if TYPE_CHECKING:
    from simscen.core.records.trace import Ticks, Trace

BELIEF_TIMEOUT_S = 1.0
"""Validity of a pose estimate in s (AMCL's transform_tolerance)."""


def pose_error(trace: Trace) -> Samples:
    """Return the localization error (n, 2): distance in m and absolute heading error in rad.

    The samples are the published beliefs, and all truth samples while the newest belief is older than
    BELIEF_TIMEOUT_S.
    There is no alignment, because an offset in the map frame is an error (APE of evo without --align).
    """
    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses):
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 2)))
    ticks = np.union1d(belief.ticks, _ticks_with_stale_belief(trace))
    believed = belief.at(ticks)
    x, y = (np.interp(ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    distances = np.hypot(believed[:, 0] - x, believed[:, 1] - y)
    return Samples(ticks, np.column_stack((distances, np.abs(wrap_array(believed[:, 2] - yaw)))))


def _ticks_with_stale_belief(trace: Trace) -> Ticks:
    ticks, published = trace.truth.ticks, trace.belief.ticks
    newest = published[np.maximum(np.searchsorted(published, ticks) - 1, 0)]  # strictly before each tick
    old: Ticks = ticks[ticks - newest > BELIEF_TIMEOUT_S * trace.tick_rate]
    return old


DIMENSIONS = 3
"""Number of degrees of freedom (x, y, yaw), which is the mean NEES of a correct covariance."""


def nees(error: Array, covariance: Array) -> Array:
    """Return e' P^-1 e of errors (n, 3) in m, m, rad and covariances xx, xy, xa, yy, ya, aa (n, 6).

    The Cholesky decomposition is used. The result is infinite if P is not positive definite, for example for a
    depleted particle set. (filterpy's stats.NEES; Bar-Shalom, Li, Kirubarajan 2001, section 5.4.)
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
    values: Array = np.where(definite, value, np.inf)
    return values


def nees_samples(trace: Trace) -> Samples:
    """Return the NEES (n, 1) of each belief, or no samples without covariances."""
    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses) or belief.values.shape[1] < 9:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 1)))
    x, y = (np.interp(belief.ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(belief.ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    error = np.column_stack((belief.values[:, 0] - x, belief.values[:, 1] - y, wrap_array(belief.values[:, 2] - yaw)))
    return Samples(belief.ticks, nees(error, belief.values[:, 3:])[:, np.newaxis])
