"""Metrics of the driven path (turns and curvature), and of the errors of the estimated pose."""

from collections.abc import Set

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.criteria.trace_signals.estimation_errors import (
    NO_BELIEF,
    error_weights,
    interpolate_poses,
    nees_samples,
    pose_error,
    root_mean_square,
)
from simscen.criteria.trace_signals.ground_truth import DrivenPath, teleport_samples, truth

CURVATURE_SPACING_M = 0.3
"""Minimum distance between the points from which the curvature is computed, as in bench-mr."""

Values = dict[str, float | str]
"""Metrics by name. A value is a number, or the reason why the metric is undefined."""

_CURVATURE = ("norm_curvature", "max_curvature")
PATH_METRICS = ("heading_change", "path_irregularity", "aol", *_CURVATURE)
"""Metrics that `path_metrics` returns. `aol` is the angle over length."""


def path_metrics(trace: Trace, path: DrivenPath) -> Values:
    """Return the PATH_METRICS of the driven path, without teleportations."""
    segments = path_segments(trace, path)
    total_turn = heading_change(trace)
    return {
        "heading_change": total_turn,
        "path_irregularity": _irregularity(trace, total_turn),
        "aol": sum(_slope_changes(each) for each in segments) / path.length
        if path.length > 0
        else "the robot never drove",
        **_curvature(segments),
    }


def path_segments(trace: Trace, path: DrivenPath) -> list[Array]:
    """Return the points (n, 2) of each part of the driven path between teleportations."""
    corners = truth(trace).at(path.ticks)[:, :2]
    breaks = np.flatnonzero(np.diff(path.travelled) == 0.0) + 1
    return [segment for segment in np.split(corners, breaks) if len(segment)]


def heading_change(trace: Trace) -> float:
    """Return the sum of the absolute changes of the true heading in rad, without teleportations."""
    changes = np.abs(wrap_array(np.diff(truth(trace).values[:, 2])))
    changes[[k - 1 for k in teleport_samples(trace) if 0 < k <= len(changes)]] = 0.0
    return float(changes.sum())


def _irregularity(trace: Trace, total_turn: float) -> float | str:
    """Return `total_turn` minus the turns of the first plan to each goal in rad, or why this is undefined."""
    starts = [event.tick for event in trace.of_kind(EventKind.GOAL_ACCEPTED)]
    first_plans = [next((plan for plan in trace.plans if plan.tick >= start), None) for start in starts]
    if not starts or None in first_plans:
        return "no goal was accepted, or a goal has no plan to compare with"
    headings = [plan.points[:, 2] for plan in first_plans if plan is not None]
    return max(0.0, total_turn - sum(float(np.abs(wrap_array(np.diff(yaw))).sum()) for yaw in headings))


def _slope_changes(segment: Array) -> float:
    """Return the sum of the absolute changes of direction in rad along the points (n, 2) of a segment."""
    steps = np.diff(segment, axis=0)
    return float(np.abs(wrap_array(np.diff(np.arctan2(steps[:, 1], steps[:, 0])))).sum())


def _curvature(segments: list[Array]) -> Values:
    """Return norm_curvature (the sum of curvature times length) and max_curvature.

    The curvature is 1 / radius of the circle through three consecutive points.
    """
    weighted, curvatures = 0.0, []
    for segment in segments:
        points = _resample(segment)
        before, after = points[1:-1] - points[:-2], points[2:] - points[1:-1]
        a, b = np.hypot(*before.T), np.hypot(*after.T)
        across = np.hypot(*(points[2:] - points[:-2]).T)
        area = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / 2
        # A path that reverses has three points on a line and an infinite radius, as in bench-mr.
        curvature = np.divide(4 * area, a * b * across, out=np.zeros_like(area), where=across > 0)
        weighted += float((curvature * (a + b)).sum())
        curvatures.append(curvature)
    if not any(len(each) for each in curvatures):
        short = f"the path is too short: it has fewer than three points {CURVATURE_SPACING_M:g} m apart"
        return dict.fromkeys(_CURVATURE, short)
    return {"norm_curvature": weighted, "max_curvature": float(np.concatenate(curvatures).max())}


def _resample(segment: Array) -> Array:
    """Return a subset of the points (n, 2) in which consecutive points are at least CURVATURE_SPACING_M apart."""
    indices = [0]
    xs, ys = segment[:, 0].tolist(), segment[:, 1].tolist()
    for k in range(1, len(xs)):
        if (xs[k] - xs[indices[-1]]) ** 2 + (ys[k] - ys[indices[-1]]) ** 2 >= CURVATURE_SPACING_M**2:
            indices.append(k)
    points: Array = segment[indices]
    return points


RPE_DELTA_M = 1.0
"""Minimum driven distance between the two poses of a relative pose error (RPE)."""

_STATISTICS = ("rmse", "mean", "median", "max")


def pose_metrics(trace: Trace) -> Values:
    """Return the POSE_METRICS: absolute and relative errors of the estimated pose (APE, RPE), and NEES."""
    error = pose_error(trace)
    if not len(error):
        return dict.fromkeys(POSE_METRICS, NO_BELIEF)
    distances, angles = error.values.T
    weights = error_weights(trace, error)
    return {
        **_error_statistics("ape_trans", distances, weights),
        "ape_trans_final": float(distances[-1]),
        **_error_statistics("ape_rot", angles, weights),
        **_relative_errors(trace),
        "nees": _nees(trace),
    }


def _error_statistics(name: str, errors: Array, weights: Array) -> Values:
    """Return the weighted statistics of errors (n,)."""
    return {
        f"{name}_rmse": root_mean_square(errors, weights),
        f"{name}_mean": float(np.average(errors, weights=weights)),
        f"{name}_median": _median(errors, weights),
        f"{name}_max": float(np.max(errors)),
    }


def _median(values: Array, weights: Array) -> float:
    """Return the weighted median: half of the weight belongs to lower values.

    If the half lies exactly between two values, return the mean of these values.
    """
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    first, second = (np.searchsorted(below, below[-1] / 2, side=side) for side in ("left", "right"))
    return float(values[order[[first, second]]].mean())


def _relative_errors(trace: Trace) -> Values:
    """Return the RPE metrics: statistics of (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) with true poses Q and estimated poses P.

    Between the samples i and j, the robot drove at least RPE_DELTA_M, and was not teleported.
    """
    estimated, true = trace.belief.values, interpolate_poses(truth(trace), trace.belief.ticks)
    teleported = frozenset(teleport_samples(trace, trace.belief.ticks))
    i, j = _pairs(np.linalg.norm(np.diff(true[:, :2], axis=0), axis=1), teleported)
    if not len(i):
        return {
            f"rpe_{part}_{statistic}": f"the robot drove less than {RPE_DELTA_M:g} m"
            for part in _POSE_PARTS
            for statistic in _STATISTICS
        }
    true_motion, estimated_motion = _relative_poses(true[i], true[j]), _relative_poses(estimated[i], estimated[j])
    error, weights = _relative_poses(true_motion, estimated_motion), np.ones(len(i))
    return {
        **_error_statistics("rpe_trans", np.hypot(error[:, 0], error[:, 1]), weights),
        **_error_statistics("rpe_rot", np.abs(wrap_array(error[:, 2])), weights),
    }


def _pairs(steps: Array, teleported: Set[int]) -> tuple[list[int], list[int]]:
    """Return the first and the second index of pairs of samples between which the robot drove at least RPE_DELTA_M.

    `steps` are the distances in m between consecutive samples. A new pair begins at each sample in `teleported`.
    """
    pairs: list[tuple[int, int]] = []
    first, length = 0, 0.0
    for k, step in enumerate(steps.tolist(), start=1):
        length += step
        if k in teleported:
            first, length = k, 0.0
        elif length >= RPE_DELTA_M:
            pairs.append((first, k))
            first, length = k, 0.0
    return [first for first, _ in pairs], [second for _, second in pairs]


def _relative_poses(origin: Array, poses: Array) -> Array:
    """Return poses (n, 3 or more columns) relative to `origin` (n, 3)."""
    c, s = np.cos(origin[:, 2]), np.sin(origin[:, 2])
    dx, dy = (poses - origin)[:, :2].T
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, poses[:, 2] - origin[:, 2]))


def _nees(trace: Trace) -> float | str:
    values = nees_samples(trace).values
    if not len(values):
        return "the belief has no covariance"
    mean = float(values.mean())
    return (
        mean if np.isfinite(mean) else "infinite: the estimated covariance is singular, so the robot is overconfident"
    )


_POSE_PARTS = ("trans", "rot")
POSE_METRICS = (
    *(f"{error}_{part}_{name}" for error in ("ape", "rpe") for part in _POSE_PARTS for name in _STATISTICS),
    "ape_trans_final",
    "nees",
)
"""Metrics that `pose_metrics` returns."""
