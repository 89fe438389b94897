"""Hypothesis strategies for moments with any content that their types allow."""

import dataclasses
import math

import numpy as np
from hypothesis import strategies as st

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Path
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision, Moment, Truth

ticks = st.integers(0, 10**6)
floats = st.floats(allow_infinity=False)
quaternion_parts = st.floats(-1, 1) | st.just(float("nan"))

twists = st.builds(Twist, floats, floats, floats)
poses = st.builds(Pose2, floats, floats, floats)


def _unit(*quaternion: float) -> tuple[float, ...]:
    length = math.hypot(*quaternion)
    return (0.0, 0.0, 0.0, 1.0) if length == 0.0 else tuple(part / length for part in quaternion)


rotations = st.builds(_unit, *[quaternion_parts] * 4)
poses_3d = st.builds(lambda x, y, z, q: Pose3(x, y, z, *q), *[st.floats()] * 3, rotations)
truths = st.builds(Truth, poses_3d, twists, st.floats(), st.dictionaries(st.text(max_size=5), poses_3d, max_size=2))

matrices = st.lists(st.floats(), min_size=9, max_size=9).map(lambda numbers: np.array(numbers).reshape(3, 3))
beliefs = st.builds(Belief, poses, matrices, poses)
points = st.lists(st.tuples(floats, floats, floats), max_size=4).map(lambda rows: np.array(rows).reshape(-1, 3))
plans = st.builds(Path, points, ticks)
event_data = st.dictionaries(st.text(), st.floats() | st.text() | st.none() | st.booleans(), max_size=3)
events = st.lists(st.builds(Event, ticks, st.sampled_from(EventKind), st.text(), event_data), max_size=2).map(tuple)
decisions = st.builds(Decision, twists, st.none() | beliefs, st.none() | plans, st.none() | plans, events)

odometries = st.builds(Odometry, st.sampled_from(["a", "b"]), ticks, poses, twists)
beams = st.just(np.array([1.0, np.inf, np.nan]))
scans = st.builds(Scan, st.sampled_from(["c", "d"]), ticks, beams, *map(st.just, (0.0, 0.1, 0.0, 9.0)))
readings = st.lists(odometries | scans, max_size=3).map(tuple)

MAX_MOMENTS = 6
moments = st.lists(st.builds(Moment, st.just(0), st.none() | truths, readings, decisions, events), max_size=MAX_MOMENTS)
gaps = st.lists(st.integers(1, 300), min_size=MAX_MOMENTS, max_size=MAX_MOMENTS)


def with_intervals(run: list[Moment], intervals: list[int]) -> list[Moment]:
    """Return the moments with these intervals in ticks between them. Events happen no later than their moment."""
    return [_at(moment, tick) for moment, tick in zip(run, np.cumsum(intervals).tolist(), strict=False)]


def _at(moment: Moment, tick: int) -> Moment:
    world_events, stack_events = (
        tuple(dataclasses.replace(event, tick=min(event.tick, tick)) for event in events)
        for events in (moment.events, moment.decision.events)
    )
    return dataclasses.replace(
        moment, tick=tick, events=world_events, decision=dataclasses.replace(moment.decision, events=stack_events)
    )


runs = st.builds(with_intervals, moments, gaps)
