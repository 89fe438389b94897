"""Errors of the estimated pose: position error, heading error, and NEES (normalized estimation error squared).

A belief is an estimated pose with its covariance. Estimated and true poses are compared without alignment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.criteria.trace_signals.ground_truth import check_samples, truth
from simscen.criteria.trace_signals.sampling import usual_period

if TYPE_CHECKING:
    from simscen.core.records.trace import Samples, Ticks, Trace

BELIEF_TIMEOUT_S = 1.0
"""Maximum age of a valid belief, like transform_tolerance of nav2_amcl."""
NO_BELIEF = "the robot never reported an estimated pose"
"""Reason of inconclusive findings and undefined metrics if the trace has no belief."""


def pose_error(trace: Trace) -> Samples:
    """Return the localization error (n, 2): position error in m, and absolute heading error in rad.

    There is a sample for each published belief, and for each sample of the truth at which the newest belief is older
    than BELIEF_TIMEOUT_S. The result is empty if the trace has no belief or no truth.
    """
    from simscen.core.records.trace import Samples

    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses):
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 2)))
    ticks = np.union1d(belief.ticks, _ticks_with_stale_belief(trace))
    believed = belief.at(ticks)
    x, y, yaw = interpolate_poses(poses, ticks).T
    distances = np.hypot(believed[:, 0] - x, believed[:, 1] - y)
    return Samples(ticks, np.column_stack((distances, np.abs(wrap_array(believed[:, 2] - yaw)))))


def error_weights(trace: Trace, error: Samples) -> Array:
    """Return the weights (n,) of the samples of `pose_error` in statistics.

    Each published belief has the weight 1, as in evo. The samples of the truth during which the newest belief is old
    together have the weight that beliefs at the usual rate would have in this time.
    """
    published, timeout = trace.belief.ticks, BELIEF_TIMEOUT_S * trace.tick_rate
    belief_period = min(usual_period(published), timeout) if len(published) > 1 else timeout
    old_weight = min(1.0, usual_period(trace.truth.ticks) / belief_period)
    return np.where(np.isin(error.ticks, published), 1.0, old_weight)


def root_mean_square(values: Array, weights: Array) -> float:
    """Return the weighted root mean square of `values` (n,)."""
    return float(np.sqrt(np.average(values**2, weights=weights)))


def interpolate_poses(poses: Samples, ticks: Ticks) -> Array:
    """Return the poses (n, 3) at the given ticks by linear interpolation; yaw is not wrapped."""
    x, y = (np.interp(ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    return np.column_stack((x, y, np.interp(ticks, poses.ticks, np.unwrap(poses.values[:, 2]))))


def _ticks_with_stale_belief(trace: Trace) -> Ticks:
    """Return the ticks of samples of the truth at which the newest belief is older than BELIEF_TIMEOUT_S."""
    ticks, published = trace.truth.ticks, trace.belief.ticks
    newest = published[np.maximum(np.searchsorted(published, ticks) - 1, 0)]  # strictly before each tick
    old: Ticks = ticks[ticks - newest > BELIEF_TIMEOUT_S * trace.tick_rate]
    return old


DIMENSIONS = 3
"""Number of components of a pose (x, y, yaw), which is the mean NEES if the covariance is correct."""


def nees(error: Array, covariance: Array) -> Array:
    """Return the NEES e' P^-1 e (n,) of errors e (n, 3) in m, m, rad with covariances P (n, 6).

    P contains the upper triangles xx, xy, xa, yy, ya, aa, where a is the yaw. The result is inf if P is not positive
    definite. The method is Cholesky decomposition. Source: Bar-Shalom, Li, Kirubarajan 2001, section 5.4.
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
    """Return the NEES (n, 1) of each belief; empty if the trace has no truth or no covariances."""
    from simscen.core.records.trace import Samples

    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses) or belief.values.shape[1] < 9:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 1)))
    error = belief.values[:, :3] - interpolate_poses(poses, belief.ticks)
    error[:, 2] = wrap_array(error[:, 2])
    return Samples(belief.ticks, nees(error, belief.values[:, 3:])[:, np.newaxis])
