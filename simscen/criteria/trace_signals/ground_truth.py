"""True motion of the robot in a trace: pose, speed, clearance, and driven path.

Functions raise InvalidTrace if a value of the trace is not finite, except a clearance of inf.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import EventKind
from simscen.criteria.findings import InvalidTrace, MissingEvidence

if TYPE_CHECKING:
    import numpy.typing as npt

    from simscen.core.records.trace import Samples, Ticks, Trace

    Flags = npt.NDArray[np.bool_]
else:
    Flags = object  # annotations are not evaluated, and numpy's types take long to import

MIN_MOVE_M = 0.01
"""Minimum length of a move that counts as driven. Shorter moves are jitter."""


def reject_samples(trace: Trace, ticks: Ticks, is_invalid: Flags, problem: str) -> None:
    """Raise InvalidTrace if a sample is invalid. `problem` is the message before the time of the first such sample."""
    if is_invalid.any():
        at = trace.seconds(int(ticks[int(np.argmax(is_invalid))]))
        raise InvalidTrace(f"{problem} t = {at:.2f} s")


def check_samples(samples: Samples, name: str, trace: Trace) -> Samples:
    """Return `samples`. Raises InvalidTrace if a value is not finite. `name` is the signal in the message."""
    is_invalid: Flags = np.logical_not(np.isfinite(samples.values).all(axis=1))
    reject_samples(trace, samples.ticks, is_invalid, f"{name} is not finite at")
    return samples


def truth(trace: Trace) -> Samples:
    """Return the true poses (n, 3) of the robot in the world frame: x and y in m, yaw in rad."""
    return check_samples(trace.truth, "the true pose", trace)


def true_pose(trace: Trace, tick: int) -> Pose2:
    """Return the true pose at `tick`. Raises MissingEvidence if the trace does not contain true poses."""
    poses = truth(trace)
    if not len(poses):
        raise MissingEvidence("the robot's true path was not recorded")
    return Pose2(*poses.at(np.array([tick]))[0].tolist())


def clearance(trace: Trace) -> Samples:
    """Return the recorded distance (n, 1) in m from the robot to the nearest surface.

    During an overlap, the distance is negative by the depth of the overlap. simscen records larger distances than
    `Case.clearance_range` as this range; other logs may contain inf. Raises InvalidTrace if a value is nan or -inf.
    """
    distances = trace.clearance.values[:, 0]
    is_invalid = np.isnan(distances) | np.isneginf(distances)
    reject_samples(trace, trace.clearance.ticks, is_invalid, "the clearance is not a number at")
    return trace.clearance


def speed(trace: Trace) -> Samples:
    """Return the true speed over ground (n, 1) in m/s."""
    velocity = check_samples(trace.velocity, "the true velocity", trace)
    return type(velocity)(velocity.ticks, np.hypot(velocity.values[:, 0], velocity.values[:, 1])[:, np.newaxis])


def turn_rate(trace: Trace) -> Samples:
    """Return the magnitude of the true turn rate (n, 1) in rad/s."""
    velocity = check_samples(trace.velocity, "the true velocity", trace)
    return type(velocity)(velocity.ticks, np.abs(velocity.values[:, 2])[:, np.newaxis])


@dataclass(frozen=True, eq=False)
class DrivenPath:
    """Length of the driven path over time: at `ticks[k]`, the robot had driven `travelled[k]` m."""

    ticks: Ticks
    travelled: Array

    @property
    def length(self) -> float:
        """Total length in m."""
        return float(self.travelled[-1]) if len(self.travelled) else 0.0

    def until(self, tick: int) -> float:
        """Return the length in m of the path up to `tick`."""
        driven = self.travelled[self.ticks <= tick]
        return float(driven[-1]) if len(driven) else 0.0


def drive(trace: Trace) -> DrivenPath:
    """Return the driven path in the plane, in moves of at least MIN_MOVE_M. Teleportation does not count."""
    poses, teleported = truth(trace), set(teleport_samples(trace))
    indices, lengths = [0], [0.0]
    points = poses.values[:, :2].tolist()
    if not points:
        return DrivenPath(np.empty(0, dtype=np.int64), np.empty(0))
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
    return DrivenPath(poses.ticks[indices], np.cumsum(lengths))


def teleport_samples(trace: Trace, ticks: Ticks | None = None) -> list[int]:
    """Return the index of the first sample after each teleportation of the robot, sorted.

    `ticks` are the ticks of the samples; None for the samples of the truth. The index is the number of samples if there
    is no later sample.
    """
    placed = sorted({event.tick for event in trace.of_kind(EventKind.ROBOT_PLACED)})
    samples: list[int] = np.searchsorted(trace.truth.ticks if ticks is None else ticks, placed, side="right").tolist()
    return samples
