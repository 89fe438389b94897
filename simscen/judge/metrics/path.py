"""The shape of the driven way: lengths, turns, curvature."""

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.criteria.trace_signals.ground_truth import Drive, teleport_samples, truth

CURVATURE_SPACING_M = 0.3
"""Meters between the points of which curvature is taken; nearer ones are noise (bench-mr)."""

Values = dict[str, float | str]
"""Metrics by name; a text says why there is no number."""

_CURVATURE = ("norm_curvature", "max_curvature")
PATH_METRICS = ("heading_change", "path_irregularity", "aol", *_CURVATURE)


def path_metrics(trace: Trace, way: Drive) -> Values:
    """Turns and curvature of the true way, which the robot drove so; being set down elsewhere is no part of it."""
    legs = path_segments(trace, way)
    turned = heading_change(trace)
    return {
        "heading_change": turned,
        "path_irregularity": _irregularity(trace, turned),
        "aol": sum(_turned(leg) for leg in legs) / way.length if way.length > 0 else "the robot never drove",
        **_curvature(legs),
    }


def path_segments(trace: Trace, way: Drive) -> list[Array]:
    """The corners (n, 2) of each piece of the way that was driven without being set down elsewhere."""
    corners = truth(trace).at(way.ticks)[:, :2]
    breaks = np.flatnonzero(np.diff(way.travelled) == 0.0) + 1
    return [leg for leg in np.split(corners, breaks) if len(leg)]


def heading_change(trace: Trace) -> float:
    """Sum of the changes of the true heading, in rad; yaw differences are wrapped (Arena's are not)."""
    changes = np.abs(wrap_array(np.diff(truth(trace).values[:, 2])))
    changes[[k - 1 for k in teleport_samples(trace) if 0 < k <= len(changes)]] = 0.0
    return float(changes.sum())


def _irregularity(trace: Trace, turned: float) -> float | str:
    """What was turned beyond the first plan to each goal (SEAN; a stub in HuNavSim)."""
    starts = [event.tick for event in trace.of_kind(EventKind.GOAL_ACCEPTED)]
    first = [next((plan for plan in trace.plans if plan.tick >= start), None) for start in starts]
    if not starts or None in first:
        return "there is no plan to each goal to compare with"
    headings = [plan.points[:, 2] for plan in first if plan is not None]
    return max(0.0, turned - sum(float(np.abs(wrap_array(np.diff(yaw))).sum()) for yaw in headings))


def _turned(leg: Array) -> float:
    steps = np.diff(leg, axis=0)
    return float(np.abs(wrap_array(np.diff(np.arctan2(steps[:, 1], steps[:, 0])))).sum())


def _curvature(legs: list[Array]) -> Values:
    weighted, bends = 0.0, []
    for leg in legs:
        points = _resampled(leg)
        before, after = points[1:-1] - points[:-2], points[2:] - points[1:-1]
        a, b = np.hypot(*before.T), np.hypot(*after.T)
        across = np.hypot(*(points[2:] - points[:-2]).T)
        area = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / 2
        # A way that turns back on itself has three points on a line: no circle, and bench-mr's radius of infinity.
        bend = np.divide(4 * area, a * b * across, out=np.zeros_like(area), where=across > 0)
        weighted += float((bend * (a + b)).sum())
        bends.append(bend)
    if not any(len(bend) for bend in bends):
        short = f"the robot drove too short a way: fewer than three points {CURVATURE_SPACING_M:g} m apart"
        return dict.fromkeys(_CURVATURE, short)
    return {"norm_curvature": weighted, "max_curvature": float(np.concatenate(bends).max())}


def _resampled(leg: Array) -> Array:
    """Its corners that are at least RESAMPLED from the one before."""
    kept = [0]
    xs, ys = leg[:, 0].tolist(), leg[:, 1].tolist()
    for k in range(1, len(xs)):
        if (xs[k] - xs[kept[-1]]) ** 2 + (ys[k] - ys[kept[-1]]) ** 2 >= CURVATURE_SPACING_M**2:
            kept.append(k)
    chosen: Array = leg[kept]
    return chosen
