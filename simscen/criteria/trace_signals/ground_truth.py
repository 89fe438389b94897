"""Signals that criteria read off a trace. All are checked to be finite: nan compares false and would hide a failure."""

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
"""Meters; shorter moves are the trembling of a body at rest and are not driven (METRICS: path_length)."""

BELIEF_TIMEOUT_S = 1.0
"""Seconds; how long a pose estimate may be relied on (AMCL's transform_tolerance)."""


def check_samples(samples: Samples, name: str, trace: Trace) -> Samples:
    """Return the samples. Raises InvalidTrace with signal and time if a value is nan or infinite."""
    bad = ~np.isfinite(samples.values).all(axis=1)
    if bad.any():
        at = trace.seconds(int(samples.ticks[int(np.argmax(bad))]))
        raise InvalidTrace(f"{name} is not finite at t = {at:.2f} s")
    return samples


def truth(trace: Trace) -> Samples:
    """x, y, yaw of the robot in the world."""
    return check_samples(trace.truth, "the true pose", trace)


def true_pose(trace: Trace, tick: int) -> Pose2:
    """Where the robot really was at `tick`. Raises MissingEvidence for a trace without the truth."""
    poses = truth(trace)
    if not len(poses):
        raise MissingEvidence("the robot's true way was not recorded")
    return Pose2(*poses.at(np.array([tick]))[0].tolist())


def clearance(trace: Trace) -> Samples:
    """Distance of the hull to the nearest surface (m), (n, 1); space that is free for ever may be infinite."""
    bad = np.isnan(trace.clearance.values[:, 0]) | np.isneginf(trace.clearance.values[:, 0])
    if bad.any():
        at = trace.seconds(int(trace.clearance.ticks[int(np.argmax(bad))]))
        raise InvalidTrace(f"the clearance is not a number at t = {at:.2f} s")
    return trace.clearance


def check_finite(trace: Trace) -> None:
    """Raise InvalidTrace for a signal that has to be finite and is not, whatever a criterion looks at.

    Odometry may be anything: it is a reading, and what a fault makes of readings is no defect of the run.
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
    """The driven way: corner k was left behind at `ticks[k]` after `travelled[k]` meters."""

    ticks: Ticks
    travelled: Array

    @property
    def length(self) -> float:
        """Meters in all."""
        return float(self.travelled[-1]) if len(self.travelled) else 0.0

    def until(self, tick: int) -> float:
        """Meters driven up to `tick`."""
        driven = self.travelled[self.ticks <= tick]
        return float(driven[-1]) if len(driven) else 0.0


def drive(trace: Trace) -> Drive:
    """Return the driven path in the plane, in moves of at least SMALLEST_MOVE, without teleportation.

    Yaw is not part of the distance, unlike in Arena's get_metrics.py, which adds radians to meters.
    """
    poses, carried = truth(trace), set(teleport_samples(trace))
    kept, lengths = [0], [0.0]
    points = poses.values[:, :2].tolist()
    if not points:
        return Drive(np.empty(0, dtype=np.int64), np.empty(0))
    last = points[0]
    for k, point in enumerate(points[1:], start=1):
        step = math.dist(point, last)
        if k in carried:
            step = 0.0
        elif step < MIN_MOVE_M:
            continue
        kept.append(k)
        lengths.append(step)
        last = point
    return Drive(poses.ticks[kept], np.cumsum(lengths))


def teleport_samples(trace: Trace, ticks: Ticks | None = None) -> list[int]:
    """Return the indices of the samples before which the robot was set down elsewhere.

    Such a step is neither driving nor braking. `ticks` are the samples' ticks; by default those of the truth.
    """
    placed = sorted({event.tick for event in trace.of_kind(EventKind.ROBOT_PLACED)})
    samples: list[int] = np.searchsorted(trace.truth.ticks if ticks is None else ticks, placed, side="right").tolist()
    return samples


def pose_error(trace: Trace) -> Samples:
    """How far the belief is off: distance (m) and heading (rad, without its sign), (n, 2).

    Sampled whenever the belief is published, against the truth at that very tick; and at every truth sample while the
    newest belief is older than STALE_AFTER, when the robot has nothing better than the old one. No alignment: a map
    localizer answers in the map's frame, and an offset there is an error (evo would call it APE without --align).
    """
    from simscen.core.records.trace import Samples

    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses):
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 2)))
    ticks = np.union1d(belief.ticks, _stale(trace))
    believed = belief.at(ticks)
    x, y = (np.interp(ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    off = np.hypot(believed[:, 0] - x, believed[:, 1] - y)
    return Samples(ticks, np.column_stack((off, np.abs(wrap_array(believed[:, 2] - yaw)))))


def _stale(trace: Trace) -> Ticks:
    ticks, came = trace.truth.ticks, trace.belief.ticks
    newest = came[np.maximum(np.searchsorted(came, ticks) - 1, 0)]  # before each: where one comes, there is a sample
    old: Ticks = ticks[ticks - newest > BELIEF_TIMEOUT_S * trace.tick_rate]
    return old


def first_sustained(ticks: Ticks, true: Flags, hold: int, end: int) -> tuple[int | None, bool]:
    """Return the first of `ticks` from which `true` lasts `hold` ticks or until `end`, and whether it lasted `hold`.

    An interval lasts until the next sample that is not true. Without such an interval, the result is (None, False).
    """
    begins = np.flatnonzero(true & ~np.concatenate(([False], true[:-1])))
    breaks = np.flatnonzero(~true & np.concatenate(([False], true[:-1])))
    stops = np.full(len(begins), end, dtype=np.int64)
    stops[: len(breaks)] = ticks[breaks]
    lasting = stops - ticks[begins] >= hold
    if lasting.any():
        return int(ticks[begins[int(np.argmax(lasting))]]), True
    return (int(ticks[begins[-1]]), False) if len(true) and true[-1] else (None, False)


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
    from simscen.core.records.trace import Samples

    belief, poses = check_samples(trace.belief, "the belief", trace), truth(trace)
    if not len(belief) or not len(poses) or belief.values.shape[1] < 9:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 1)))
    x, y = (np.interp(belief.ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(belief.ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    error = np.column_stack((belief.values[:, 0] - x, belief.values[:, 1] - y, wrap_array(belief.values[:, 2] - yaw)))
    return Samples(belief.ticks, nees(error, belief.values[:, 3:])[:, np.newaxis])
