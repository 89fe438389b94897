"""Traces and cases from short descriptions, for golden cases and the documentation of criteria."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.navigation import Goal, Path
from simscen.core.records.case import CLEARANCE_RANGE, Case, Passage
from simscen.core.records.events import Disturbance, Event, EventKind
from simscen.core.records.trace import Samples, Ticks, Trace

TICK_RATE, TRUTH_PERIOD, SCAN_PERIOD, BELIEF_PERIOD = 240, 6, 24, 24


def synthetic_trace(words: Mapping[str, Any]) -> Trace:
    """Return a trace with 240 Hz ticks, truth at 40 Hz, scans and belief at 10 Hz.

    seconds: duration · truth: waypoints [t, x, y, yaw] with straight lines at constant speed between them · belief:
    waypoints, or {offset: [dx, dy, dyaw]} from the truth, or null for none · clearance: [t, meters] or one number ·
    scans: intervals [from, to] with scans · events: [t, kind, name, {data}] · plans: [t, [[x, y], …]] · objects:
    {name: waypoints} · ended: why the run ended; null for a truncated log.
    """
    end = round(words["seconds"] * TICK_RATE)
    ticks = np.arange(0, end + 1, TRUTH_PERIOD, dtype=np.int64)
    truth = _way(words["truth"], ticks)
    return Trace(
        tick_rate=TICK_RATE,
        truth=truth,
        velocity=Samples(ticks, _velocity(truth)),
        clearance=_clearance(words.get("clearance", 1.0), ticks),
        belief=_belief(words.get("belief", {"offset": [0, 0, 0]}), words["truth"], end),
        odometry=truth,
        command=Samples(ticks, _velocity(truth)),
        scans=_scans(words.get("scans", [[0, words["seconds"]]]), end),
        plans=tuple(Path(_lifted(points), round(t * TICK_RATE)) for t, points in words.get("plans", [])),
        events=_events(words, end),
        objects={name: _way(way, ticks) for name, way in sorted(words.get("objects", {}).items())},
        end=end,
    )


def _way(waypoints: Sequence[Sequence[float]], ticks: Ticks) -> Samples:
    """Return x, y, yaw at `ticks`, interpolated between waypoints; headings turn the shorter way."""
    points = np.array([[*point, 0.0][:4] for point in waypoints], dtype=np.float64)
    times = ticks / TICK_RATE
    columns = [np.interp(times, points[:, 0], points[:, axis]) for axis in (1, 2)]
    yaw = wrap_array(np.interp(times, points[:, 0], np.unwrap(points[:, 3])))
    return Samples(ticks, np.column_stack((*columns, yaw)))


def _velocity(truth: Samples) -> Array:
    """Return vx, vy, wz in the base frame over the step after each sample; the last value is repeated."""
    if len(truth) < 2:
        return np.zeros((len(truth), 3))
    step = np.diff(truth.ticks) / TICK_RATE
    dx, dy, turn = np.diff(truth.values, axis=0).T / step
    turn = wrap_array(turn * step) / step
    c, s = np.cos(truth.values[:-1, 2]), np.sin(truth.values[:-1, 2])
    moving = np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))
    return np.vstack((moving, moving[-1:]))


def _belief(words: Any, truth: Sequence[Sequence[float]], end: int) -> Samples:
    if words is None:
        return Samples(np.empty(0, dtype=np.int64), np.empty((0, 9)))
    ticks = np.arange(0, end + 1, BELIEF_PERIOD, dtype=np.int64)
    if isinstance(words, Mapping):
        poses = _way(truth, ticks).values + np.array(words["offset"], dtype=np.float64)
    else:
        poses = _way(words, ticks).values
    covariance = np.tile([0.01, 0.0, 0.0, 0.01, 0.0, 0.01], (len(ticks), 1))
    return Samples(ticks, np.column_stack((poses, covariance)))


def _clearance(words: Any, ticks: Ticks) -> Samples:
    points = np.array([[0.0, words]] if isinstance(words, int | float) else words, dtype=np.float64)
    return Samples(ticks, np.interp(ticks / TICK_RATE, points[:, 0], points[:, 1])[:, np.newaxis])


def _scans(stretches: Sequence[Sequence[float]], end: int) -> Ticks:
    ticks = np.arange(0, end + 1, SCAN_PERIOD, dtype=np.int64)
    arrives = np.zeros(len(ticks), dtype=bool)
    for begin, until in stretches:
        arrives |= (ticks >= begin * TICK_RATE) & (ticks <= until * TICK_RATE)
    return ticks[arrives]


def _events(words: Mapping[str, Any], end: int) -> tuple[Event, ...]:
    events = []
    for at, kind, *rest in words.get("events", []):
        name, data = [*rest, "", {}][:2] if len(rest) != 1 else (rest[0], {})
        events.append(Event(round(at * TICK_RATE), kind, name, data))
    ended = words.get("ended", "navigation ended")
    return (*events, *([] if ended is None else [Event(end, EventKind.RUN_ENDED, ended)]))


def _lifted(points: Sequence[Sequence[float]]) -> Array:
    """Return path points with the heading of the path."""
    xy = np.array(points, dtype=np.float64)[:, :2]
    steps = np.diff(xy, axis=0)
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    return np.column_stack((xy, np.append(yaw, yaw[-1:])))


def synthetic_case(words: Mapping[str, Any]) -> Case:
    """Return a case: start [x, y, yaw] · goals [{name, pose: [x, y, yaw], xy_tolerance, …}] · sent ·
    expected {goal: failed or a code} · shortest {goal: meters} · passages [[goal, [x, y], [x, y], name, name]] ·
    disturbances [{name, kind, …}] ·
    masks {file: {resolution, origin: [x, y, yaw], blocks: [[column, row, width, height, value]]}} · …"""
    goals, sent = (
        tuple(Goal(**{**goal, "pose": _pose(goal["pose"])}) for goal in words.get(key, [])) for key in ("goals", "sent")
    )
    return Case(
        start=_pose(words.get("start", [0, 0])),
        goals=goals,
        sent=sent,
        shortest=words.get("shortest", {}),
        regions={name: tuple((x, y) for x, y in corners) for name, corners in words.get("regions", {}).items()},
        footprint=tuple((x, y) for x, y in words.get("footprint", [])),
        inscribed_radius=words.get("inscribed_radius", 0.2),
        time_limit=words.get("time_limit", 60.0),
        clearance_range=words.get("clearance_range", CLEARANCE_RANGE),
        passages=tuple(
            Passage(goal, ((ax, ay), (bx, by)), (one, other))
            for goal, (ax, ay), (bx, by), one, other in words.get("passages", [])
        ),
        masks={name: MaskBlocks(**_mask(mask)) for name, mask in words.get("masks", {}).items()},
        expected=words.get("expected", {}),
        disturbances=tuple(Disturbance(**ordered) for ordered in words.get("disturbances", [])),
    )


def _mask(words: Mapping[str, Any]) -> dict[str, Any]:
    blocks = tuple(tuple(block) for block in words["blocks"])
    return {**words, "blocks": blocks, "origin": _pose(words.get("origin", [0, 0]))}


def _pose(words: Sequence[float]) -> Pose2:
    x, y, yaw = [*words, 0.0][:3]
    return Pose2(float(x), float(y), float(yaw))
