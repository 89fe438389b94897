"""How well the robot knew where it was: absolute and relative pose errors as evo defines them, and NEES."""

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Trace
from simscen.criteria.trace_signals.ground_truth import pose_error, truth
from simscen.criteria.trace_signals.nees import nees_samples
from simscen.judge.metrics.path import Values

RPE_DELTA_M = 1.0
"""Meters of the true way between the two poses of a relative error."""

_SUMS = ("rmse", "mean", "median", "max")
SILENT = "the robot never said where it believes to be"


def pose_metrics(trace: Trace) -> Values:
    """APE, RPE over DELTA meters, NEES."""
    error = pose_error(trace)
    if not len(error):
        return dict.fromkeys(POSE_METRICS, SILENT)
    off, turned = error.values.T
    return {
        **_summed("ape_trans", off),
        "ape_trans_final": float(off[-1]),
        **_summed("ape_rot", turned),
        **_relative(trace),
        "nees": _nees(trace),
    }


def _summed(name: str, errors: Array) -> Values:
    return {
        f"{name}_rmse": float(np.sqrt(np.mean(errors**2))),
        f"{name}_mean": float(np.mean(errors)),
        f"{name}_median": float(np.median(errors)),
        f"{name}_max": float(np.max(errors)),
    }


def _relative(trace: Trace) -> Values:
    """(Q_i^-1 Q_j)^-1 (P_i^-1 P_j) of truth Q and belief P, where the true way from i to j is DELTA long."""
    believed, true = trace.belief.values, _truth_at_beliefs(trace)
    i, j = _pairs(np.linalg.norm(np.diff(true[:, :2], axis=0), axis=1))
    if not len(i):
        return {f"rpe_{kind}_{one}": f"the robot drove less than {RPE_DELTA_M:g} m" for kind in _KINDS for one in _SUMS}
    moved_true, moved_believed = _between(true[i], true[j]), _between(believed[i], believed[j])
    error = _between(moved_true, moved_believed)
    return {
        **_summed("rpe_trans", np.hypot(error[:, 0], error[:, 1])),
        **_summed("rpe_rot", np.abs(wrap_array(error[:, 2]))),
    }


def _pairs(steps: Array) -> tuple[list[int], list[int]]:
    """Consecutive samples between which the steps add up to DELTA (evo's filter_pairs_by_path)."""
    ids, length = [0], 0.0
    for k, step in enumerate(steps.tolist(), start=1):
        length += step
        if length >= RPE_DELTA_M:
            ids.append(k)
            length = 0.0
    return ids[:-1], ids[1:]


def _between(origin: Array, poses: Array) -> Array:
    """The poses (n, 3), or with more behind, as seen from `origin` (n, 3)."""
    c, s = np.cos(origin[:, 2]), np.sin(origin[:, 2])
    dx, dy = (poses - origin)[:, :2].T
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, poses[:, 2] - origin[:, 2]))


def _truth_at_beliefs(trace: Trace) -> Array:
    poses, ticks = truth(trace), trace.belief.ticks
    x, y = (np.interp(ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    return np.column_stack((x, y, np.interp(ticks, poses.ticks, np.unwrap(poses.values[:, 2]))))


def _nees(trace: Trace) -> float | str:
    values = nees_samples(trace).values
    if not len(values):
        return "the belief has no covariance"
    mean = float(values.mean())
    return mean if np.isfinite(mean) else "infinite: the believed covariance is singular, so the robot is overconfident"


_KINDS = ("trans", "rot")
POSE_METRICS = (
    *(f"{error}_{kind}_{one}" for error in ("ape", "rpe") for kind in _KINDS for one in _SUMS),
    "ape_trans_final",
    "nees",
)
