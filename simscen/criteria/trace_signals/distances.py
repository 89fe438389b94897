"""Readers of signals: distances from the robot to objects, points, goals, pedestrians, and its plan.

Unless stated otherwise, functions return one distance (n,) in m for each sample of the truth.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygon_separation import POINT, separation
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Samples
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.ground_truth import check_samples, reject_samples
from simscen.criteria.trace_signals.readers import goal_distance, sample_and_hold_belief, true_poses
from simscen.criteria.trace_signals.sampling import SignalQuery

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Ticks, Trace

_MIN_SQUARED_LENGTH_M2 = sys.float_info.min
"""Lower limit for squared lengths of segments, to avoid a division by zero."""
_MAX_BATCH_PAIRS = 1 << 22
"""Approximate number of pairs of a point and a segment that are compared at once, to limit the memory."""


def distance_to(query: SignalQuery) -> Array:
    """Return the distance from the robot's center to the point, the goal, or the origin of the object in the query.

    The distance is inf while the object does not exist.
    """
    poses, point, goal = true_poses(query.trace), query.arguments.get("point"), query.arguments.get("goal")
    if isinstance(point, Sequence):
        return np.hypot(poses[:, 0] - float(point[0]), poses[:, 1] - float(point[1]))
    if goal is None:
        name = str(query.arguments["object"])
        positions = object_positions(query.trace, name)
        distance = np.hypot(poses[:, 0] - positions[:, 0], poses[:, 1] - positions[:, 1])
        present_distance: Array = np.where(is_present(query.trace, name), distance, np.inf)
        return present_distance
    goals = {known.name: known.pose for known in query.case.every_goal}
    if goal not in goals:
        raise MissingEvidence(f"the scenario has no goal `{goal}`")
    pose = goals[str(goal)]
    return np.hypot(poses[:, 0] - pose.x, poses[:, 1] - pose.y)


def object_positions(trace: Trace, name: str) -> Array:
    """Return the positions (n, 2) of an object at the samples of the truth.

    Raises MissingEvidence if the trace does not contain the object.
    """
    parts = [
        Samples(np.array([event.tick]), np.array([[x, y]], dtype=np.float64))
        for event in trace.of_kind(EventKind.OBJECT_SPAWNED)
        if event.name == name
        and isinstance(x := event.data.get("x"), int | float)
        and isinstance(y := event.data.get("y"), int | float)
    ]
    if name in trace.objects:  # its first sample replaces the position in the event of the first spawning
        parts[:1] = [trace.objects[name]]
    if not parts:
        raise MissingEvidence(f"`{name}` never existed, or does not move")
    ticks = np.concatenate([part.ticks for part in parts])
    positions = np.concatenate([part.values[:, :2] for part in parts])
    order = np.argsort(ticks, kind="stable")  # the sample at the tick of an event precedes the event
    return check_samples(Samples(ticks[order], positions[order]), f"the pose of {name}", trace).at(trace.truth.ticks)


def is_present(trace: Trace, name: str) -> Array:
    """Return a mask (n,) of the samples of the truth at which an object exists."""
    clock = trace.truth.ticks
    changes = [
        event for event in trace.of_kind(EventKind.OBJECT_SPAWNED, EventKind.OBJECT_REMOVED) if event.name == name
    ]
    present = np.ones(len(clock), dtype=bool)
    if changes and changes[0].kind == EventKind.OBJECT_SPAWNED:
        present[:] = False
    for event in changes:
        present[np.searchsorted(clock, event.tick, side="left") :] = event.kind == EventKind.OBJECT_SPAWNED
    return present


def distance_remaining(query: SignalQuery) -> Array:
    """Return the length of the rest of the newest plan, from its point nearest to the estimated position.

    Before the first plan, return the true distance to the goal.
    """
    belief, clock = check_samples(query.trace.belief, "the belief", query.trace), query.trace.truth.ticks
    believed = sample_and_hold_belief(query.trace, belief, "belief")[:, :2]
    remaining = goal_distance(query)
    for first, last, points in _newest_plans(query.trace, clock):
        remaining[first:last] = _project_on_path(believed[first:last], points)[1]
    return remaining


def plan_deviation(query: SignalQuery) -> Array:
    """Return the distance from the true position to the newest plan; 0 before the first plan.

    Raises MissingEvidence if there is no plan.
    """
    poses = true_poses(query.trace)
    deviation = np.zeros(len(poses))
    plans = _newest_plans(query.trace, query.trace.truth.ticks)
    if not plans:
        raise MissingEvidence("no plan was recorded")
    for first, last, points in plans:
        deviation[first:last] = _project_on_path(poses[first:last, :2], points)[0]
    return deviation


def _newest_plans(trace: Trace, ticks: Ticks) -> list[tuple[int, int, Array]]:
    """Return the plans, each with the range of samples at which it was the newest plan.

    A tuple contains the index of the first sample, the index after the last sample, and the points (m, 2) of the plan.
    """
    plans = [plan for plan in trace.plans if len(plan.points)]
    is_invalid = np.array([not np.isfinite(plan.points[:, :2]).all() for plan in plans], dtype=bool)
    reject_samples(trace, np.array([plan.tick for plan in plans]), is_invalid, "the plan is not finite at")
    begins: list[int] = np.searchsorted(ticks, [plan.tick for plan in plans]).tolist()
    ends = [*begins, len(ticks)][1:]
    followed = [k for k, end in enumerate(ends) if begins[k] < end]
    return [(begins[k], ends[k], plans[k].points[:, :2]) for k in followed]


def _project_on_path(points: Array, path: Array) -> tuple[Array, Array]:
    """Return the distance (n,) in m of points (n, 2) from a path (m, 2), and the length (n,) of the path after them."""
    if len(path) == 1:
        path = np.vstack((path, path))
    steps = np.diff(path, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    nearest = _nearest_step(points, path[:-1], steps)
    offsets, step = points - path[nearest], steps[nearest]
    share = np.clip((offsets * step).sum(axis=1) / np.maximum(lengths[nearest] ** 2, _MIN_SQUARED_LENGTH_M2), 0.0, 1.0)
    distances = np.hypot(*(offsets - share[:, np.newaxis] * step).T)
    after = np.concatenate((np.cumsum(lengths[::-1])[::-1][1:], [0.0]))
    return distances, after[nearest] + (1.0 - share) * lengths[nearest]


def _nearest_step(points: Array, begins: Array, steps: Array) -> Array:
    """Return the index (n,) of the segment nearest to each point (n, 2).

    Segment k begins at `begins[k]` and ends at `begins[k] + steps[k]`; both arrays are (m, 2).
    """
    squared = np.maximum((steps**2).sum(axis=1), _MIN_SQUARED_LENGTH_M2)
    nearest = []
    for batch in np.array_split(points, 1 + len(points) * len(steps) // _MAX_BATCH_PAIRS):
        along = batch @ steps.T - (begins * steps).sum(axis=1)
        share = np.clip(along / squared, 0.0, 1.0)
        squared_offset = (begins**2).sum(axis=1) - 2.0 * (batch @ begins.T)  # and |point|^2, the same for all steps
        nearest.append((squared_offset + share * (share * squared - 2.0 * along)).argmin(axis=1))
    return np.concatenate(nearest)


INTIMATE_SPACE_M, PERSONAL_SPACE_M, SOCIAL_SPACE_M = 0.45, 1.2, 3.6
"""Distances below which the robot is in the intimate, personal, or social space of a person (Hall 1966, HuNavSim)."""


def pedestrian_radii(trace: Trace) -> dict[str, float]:
    """Return the radius in m of each pedestrian of the run, by name."""
    found: dict[str, float] = {}
    for event in trace.of_kind(EventKind.OBJECT_SPAWNED):
        size = event.data.get("size")
        if event.data.get("person") and isinstance(size, list) and size and isinstance(size[0], int | float):
            found[event.name] = float(size[0])
    return found


def pedestrian_gap(trace: Trace, case: Case) -> Array:
    """Return the distance between the robot's footprint and the nearest pedestrian's body; inf without pedestrians.

    Raises MissingEvidence if the whole run has no pedestrians.
    """
    radii = pedestrian_radii(trace)
    if not radii:
        raise MissingEvidence("there were no people")
    poses = true_poses(trace)
    nearest = np.full(len(poses), np.inf)
    for name, radius in sorted(radii.items()):
        gap = _footprint_distance(poses, object_positions(trace, name), case) - radius
        nearest = np.minimum(nearest, np.where(is_present(trace, name), np.maximum(gap, 0.0), np.inf))
    return nearest


def person_distance(query: SignalQuery) -> Array:
    """Return `pedestrian_gap` for the run in the query."""
    return pedestrian_gap(query.trace, query.case)


def _footprint_distance(poses: Array, points: Array, case: Case) -> Array:
    """Return the signed distances (n,) between the footprint at `poses` (n, 3) and points (n, 2), pair by pair.

    The inscribed circle replaces an unknown footprint.
    """
    offsets = points - poses[:, :2]
    if len(case.footprint) < 3:
        circle: Array = np.hypot(offsets[:, 0], offsets[:, 1]) - case.inscribed_radius
        return circle
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = c * offsets[:, 0] + s * offsets[:, 1], c * offsets[:, 1] - s * offsets[:, 0]  # in the robot frame
    return separation(np.stack((x, y, np.zeros_like(c)), axis=1), POINT, case.footprint)
