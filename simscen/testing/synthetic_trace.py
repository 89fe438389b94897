"""Build traces (recorded states of a run) and cases (goals, robot, and world of a run) from short descriptions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.core.records.case import CLEARANCE_RANGE_M, Case, Passage
from simscen.core.records.disturbances import Disturbance
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples, Ticks, Trace

TICK_RATE_HZ, TRUTH_PERIOD_TICKS, SCAN_PERIOD_TICKS, BELIEF_PERIOD_TICKS = 240, 6, 24, 24


def synthetic_trace(description: Mapping[str, Any]) -> Trace:
    """Return a trace with true poses at 40 Hz, and scans and beliefs at 10 Hz.

    Keys of the description, with times t in s, positions in m, and yaw in rad:

    seconds:    duration
    truth:      true poses as waypoints [t, x, y, yaw], which are interpolated linearly
    belief:     estimated poses as waypoints, or {offset: [dx, dy, dyaw]} from the true poses, or null without beliefs
    clearance:  list of [t, meters], or one number
    scans:      intervals [from, to] of t with scans
    events:     list of [t, kind, name, {data}]
    plans:      list of [t, points [[x, y], …] of the plan]
    objects:    poses of each object as {name: waypoints}
    ended:      reason why the run ended; null for a truncated log
    """
    end = round(description["seconds"] * TICK_RATE_HZ)
    ticks = np.arange(0, end + 1, TRUTH_PERIOD_TICKS, dtype=np.int64)
    truth = _poses_at(description["truth"], ticks)
    return Trace(
        tick_rate=TICK_RATE_HZ,
        truth=truth,
        velocity=Samples(ticks, _velocity(truth)),
        clearance=_clearance(description.get("clearance", 1.0), ticks),
        belief=_belief(description.get("belief", {"offset": [0, 0, 0]}), description["truth"], end),
        odometry=truth,
        command=Samples(ticks, _velocity(truth)),
        scans=_scans(description.get("scans", [[0, description["seconds"]]]), end),
        plans=tuple(Path(_path_points(points), round(t * TICK_RATE_HZ)) for t, points in description.get("plans", [])),
        events=_events(description, end),
        objects={
            name: _poses_at(waypoints, ticks) for name, waypoints in sorted(description.get("objects", {}).items())
        },
        end=end,
    )


def _poses_at(waypoints: Sequence[Sequence[float]], ticks: Ticks) -> Samples:
    """Return x, y, yaw at `ticks`, interpolated between waypoints [t, x, y, yaw]. Yaw turns the shorter way."""
    points = np.array([[*point, 0.0][:4] for point in waypoints], dtype=np.float64)
    times = ticks / TICK_RATE_HZ
    columns = [np.interp(times, points[:, 0], points[:, axis]) for axis in (1, 2)]
    yaw = wrap_array(np.interp(times, points[:, 0], np.unwrap(points[:, 3])))
    return Samples(ticks, np.column_stack((*columns, yaw)))


def _velocity(truth: Samples) -> Array:
    """Return velocities (n, 3) vx, vy, wz in the base frame from each sample to the next.

    The last velocity is repeated, so that each sample has a velocity.
    """
    if len(truth) < 2:
        return np.zeros((len(truth), 3))
    step = np.diff(truth.ticks) / TICK_RATE_HZ
    dx, dy, turn = np.diff(truth.values, axis=0).T / step
    turn = wrap_array(turn * step) / step
    c, s = np.cos(truth.values[:-1, 2]), np.sin(truth.values[:-1, 2])
    velocity = np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))
    return np.vstack((velocity, velocity[-1:]))


def _belief(description: Any, truth: Sequence[Sequence[float]], end: int) -> Samples:
    """Return estimated poses with covariances, up to the tick `end`."""
    if description is None:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 9)))
    ticks = np.arange(0, end + 1, BELIEF_PERIOD_TICKS, dtype=np.int64)
    if isinstance(description, Mapping):
        poses = _poses_at(truth, ticks).values + np.array(description["offset"], dtype=np.float64)
    else:
        poses = _poses_at(description, ticks).values
    covariance = np.tile([0.01, 0.0, 0.0, 0.01, 0.0, 0.01], (len(ticks), 1))
    return Samples(ticks, np.column_stack((poses, covariance)))


def _clearance(values: Any, ticks: Ticks) -> Samples:
    points = np.array([[0.0, values]] if isinstance(values, int | float) else values, dtype=np.float64)
    return Samples(ticks, np.interp(ticks / TICK_RATE_HZ, points[:, 0], points[:, 1])[:, np.newaxis])


def _scans(intervals: Sequence[Sequence[float]], end: int) -> Ticks:
    ticks = np.arange(0, end + 1, SCAN_PERIOD_TICKS, dtype=np.int64)
    has_scan = np.zeros(len(ticks), dtype=bool)
    for begin, until in intervals:
        has_scan |= (ticks >= begin * TICK_RATE_HZ) & (ticks <= until * TICK_RATE_HZ)
    return ticks[has_scan]


def _events(description: Mapping[str, Any], end: int) -> tuple[Event, ...]:
    events = []
    for seconds, kind, *rest in description.get("events", []):
        name, data = [*rest, "", {}][:2] if len(rest) != 1 else (rest[0], {})
        events.append(Event(round(seconds * TICK_RATE_HZ), kind, name, data))
    ended = description.get("ended", "navigation ended")
    return (*events, *([] if ended is None else [Event(end, EventKind.RUN_ENDED, ended)]))


def _path_points(points: Sequence[Sequence[float]]) -> Array:
    """Return the poses (n, 3) of a path through points [x, y]. Yaw is the direction to the next point.

    The last pose has the yaw of the previous pose; a single pose has yaw 0.
    """
    xy = np.array(points, dtype=np.float64)[:, :2]
    steps = np.diff(xy, axis=0)
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    return np.column_stack((xy, np.append(yaw, yaw[-1:] if len(yaw) else 0.0)))


def synthetic_case(description: Mapping[str, Any]) -> Case:
    """Return a case. The keys of the description are fields of Case. These fields have a simpler form:

    start:         [x, y, yaw]
    goals, sent:   list of {name, pose: [x, y, yaw], other fields of Goal}
    passages:      list of [goal, end [x, y], other end [x, y], name of one solid, name of the other solid]
    masks:         {file: {resolution, origin: [x, y, yaw], blocks: list of [column, row, width, height, value]}}
    disturbances:  list of {name, kind, other fields of Disturbance}
    """
    goals, sent = (
        tuple(Goal(**{**goal, "pose": _pose(goal["pose"])}) for goal in description.get(key, []))
        for key in ("goals", "sent")
    )
    return Case(
        start=_pose(description.get("start", [0, 0])),
        goals=goals,
        sent=sent,
        shortest=description.get("shortest", {}),
        regions={name: tuple((x, y) for x, y in corners) for name, corners in description.get("regions", {}).items()},
        footprint=tuple((x, y) for x, y in description.get("footprint", [])),
        inscribed_radius=description.get("inscribed_radius", 0.2),
        time_limit=description.get("time_limit", 60.0),
        clearance_range=description.get("clearance_range", CLEARANCE_RANGE_M),
        passages=tuple(
            Passage(goal, ((ax, ay), (bx, by)), (one, other))
            for goal, (ax, ay), (bx, by), one, other in description.get("passages", [])
        ),
        masks={name: MaskBlocks(**_mask(mask)) for name, mask in description.get("masks", {}).items()},
        expected=description.get("expected", {}),
        disturbances=tuple(Disturbance(**values) for values in description.get("disturbances", [])),
    )


def _mask(description: Mapping[str, Any]) -> dict[str, Any]:
    blocks = tuple(tuple(block) for block in description["blocks"])
    return {**description, "blocks": blocks, "origin": _pose(description.get("origin", [0, 0]))}


def _pose(values: Sequence[float]) -> Pose2:
    x, y, yaw = [*values, 0.0][:3]
    return Pose2(float(x), float(y), float(yaw))
