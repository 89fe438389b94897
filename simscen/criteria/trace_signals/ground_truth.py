"""Signals of the true motion, checked to be finite, because comparisons with nan would hide failures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.records.events import EventKind
from simscen.criteria.findings import InvalidTrace, MissingEvidence

if TYPE_CHECKING:
    import numpy.typing as npt

    from simscen.core.records.trace import Samples, Ticks, Trace

    Flags = npt.NDArray[np.bool_]
else:
    Flags = object  # annotations are not evaluated; commands that only read files need no numpy

MIN_MOVE_M = 0.01
"""Minimum length in m of a move in path_length. Shorter moves are jitter of a body at rest."""

BELIEF_TIMEOUT_S = 1.0
"""Validity of a pose estimate in s (AMCL's transform_tolerance)."""


def check_samples(samples: Samples, name: str, trace: Trace) -> Samples:
    """Return the samples. Raises InvalidTrace with signal and time if a value is nan or infinite."""
    bad = ~np.isfinite(samples.values).all(axis=1)
    if bad.any():
        at = trace.seconds(int(samples.ticks[int(np.argmax(bad))]))
        raise InvalidTrace(f"{name} is not finite at t = {at:.2f} s")
    return samples


def truth(trace: Trace) -> Samples:
    """Return x, y, yaw of the robot in the world."""
    return check_samples(trace.truth, "the true pose", trace)


def true_pose(trace: Trace, tick: int) -> Pose2:
    """Return the true pose at `tick`. Raises MissingEvidence for a trace without the truth."""
    poses = truth(trace)
    if not len(poses):
        raise MissingEvidence("the robot's true path was not recorded")
    return Pose2(*poses.at(np.array([tick]))[0].tolist())


def clearance(trace: Trace) -> Samples:
    """Return the distance (n, 1) in m of the hull to the nearest surface; infinite in unbounded free space."""
    bad = np.isnan(trace.clearance.values[:, 0]) | np.isneginf(trace.clearance.values[:, 0])
    if bad.any():
        at = trace.seconds(int(trace.clearance.ticks[int(np.argmax(bad))]))
        raise InvalidTrace(f"the clearance is not a number at t = {at:.2f} s")
    return trace.clearance


def check_finite(trace: Trace) -> None:
    """Raise InvalidTrace if a signal is not finite, whether a criterion uses it or not.

    Odometry is not checked: it is a reading, which a fault may have corrupted.
    """
    truth(trace), speed(trace), clearance(trace)
    check_samples(trace.belief, "the belief", trace)
    check_samples(trace.command, "the command", trace)
    for name, poses in sorted(trace.objects.items()):
        check_samples(poses, f"the pose of {name}", trace)


def speed(trace: Trace) -> Samples:
    """Return the true speed over ground (n, 1) in m/s."""
    velocity = check_samples(trace.velocity, "the true velocity", trace)
    return type(velocity)(velocity.ticks, np.hypot(velocity.values[:, 0], velocity.values[:, 1])[:, np.newaxis])


def turn_rate(trace: Trace) -> Samples:
    """Return the absolute true turn rate (n, 1) in rad/s."""
    velocity = check_samples(trace.velocity, "the true velocity", trace)
    return type(velocity)(velocity.ticks, np.abs(velocity.values[:, 2])[:, np.newaxis])


@dataclass(frozen=True, eq=False)
class Drive:
    """Driven path. The robot left corner k at `ticks[k]` after `travelled[k]` meters."""

    ticks: Ticks
    travelled: Array

    @property
    def length(self) -> float:
        """Total length in m."""
        return float(self.travelled[-1]) if len(self.travelled) else 0.0

    def until(self, tick: int) -> float:
        """Return the length in m up to `tick`."""
        driven = self.travelled[self.ticks <= tick]
        return float(driven[-1]) if len(driven) else 0.0


def drive(trace: Trace) -> Drive:
    """Return the driven path in the plane, in moves of at least MIN_MOVE_M, without teleportation.

    Yaw is not part of the distance, unlike in Arena's get_metrics.py, which adds radians to meters.
    """
    poses, teleported = truth(trace), set(teleport_samples(trace))
    indices, lengths = [0], [0.0]
    points = poses.values[:, :2].tolist()
    if not points:
        return Drive(np.empty(0, dtype=np.int64), np.empty(0))
    last = points[0]
    for k, point in enumerate(points[1:], start=1):
        step = math.dist(point, last)
        if k in teleported:
            step = 0.0
        elif step < MIN_MOVE_M:
            continue
        indices.append(k)
        lengths.append(step)
        last = point
    return Drive(poses.ticks[indices], np.cumsum(lengths))


def teleport_samples(trace: Trace, ticks: Ticks | None = None) -> list[int]:
    """Return the indices of the first samples after the robot was placed elsewhere.

    The step before such a sample is no motion. `ticks` are the samples' ticks; by default those of the truth.
    """
    placed = sorted({event.tick for event in trace.of_kind(EventKind.ROBOT_PLACED)})
    samples: list[int] = np.searchsorted(trace.truth.ticks if ticks is None else ticks, placed, side="right").tolist()
    return samples


def pose_error(trace: Trace) -> Samples:
    """Return the localization error (n, 2): distance in m and absolute heading error in rad.

    The samples are the published beliefs, and all truth samples while the newest belief is older than
    BELIEF_TIMEOUT_S.
    There is no alignment, because an offset in the map frame is an error (APE of evo without --align).
    """
    from simscen.core.records.trace import Samples

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


def first_sustained(ticks: Ticks, is_true: Flags, hold: int, end: int) -> tuple[int | None, bool]:
    """Return the first of `ticks` from which `is_true` lasts `hold` ticks or until `end`, and whether it lasted `hold`.

    An interval lasts until the next sample that is not true. Without such an interval, the result is (None, False).
    """
    begins = np.flatnonzero(is_true & ~np.concatenate(([False], is_true[:-1])))
    breaks = np.flatnonzero(~is_true & np.concatenate(([False], is_true[:-1])))
    stops = np.full(len(begins), end, dtype=np.int64)
    stops[: len(breaks)] = ticks[breaks]
    lasting = stops - ticks[begins] >= hold
    if lasting.any():
        return int(ticks[begins[int(np.argmax(lasting))]]), True
    return (int(ticks[begins[-1]]), False) if len(is_true) and is_true[-1] else (None, False)


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
    from simscen.core.records.trace import Samples

    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses) or belief.values.shape[1] < 9:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 1)))
    x, y = (np.interp(belief.ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(belief.ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    error = np.column_stack((belief.values[:, 0] - x, belief.values[:, 1] - y, wrap_array(belief.values[:, 2] - yaw)))
    return Samples(belief.ticks, nees(error, belief.values[:, 3:])[:, np.newaxis])
