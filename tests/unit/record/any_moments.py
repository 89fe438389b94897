"""Moments with any content that the core's types allow, as Hypothesis strategies."""

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
parts = st.floats(-1, 1) | st.just(float("nan"))

twists = st.builds(Twist, floats, floats, floats)
poses = st.builds(Pose2, floats, floats, floats)


def _unit(*quaternion: float) -> tuple[float, ...]:
    length = math.hypot(*quaternion)
    return (0.0, 0.0, 0.0, 1.0) if length == 0.0 else tuple(part / length for part in quaternion)


rotations = st.builds(_unit, *[parts] * 4)
spatial = st.builds(lambda x, y, z, q: Pose3(x, y, z, *q), *[st.floats()] * 3, rotations)
truths = st.builds(Truth, spatial, twists, st.floats(), st.dictionaries(st.text(max_size=5), spatial, max_size=2))

matrices = st.lists(st.floats(), min_size=9, max_size=9).map(lambda numbers: np.array(numbers).reshape(3, 3))
beliefs = st.builds(Belief, poses, matrices, poses)
points = st.lists(st.tuples(floats, floats, floats), max_size=4).map(lambda rows: np.array(rows).reshape(-1, 3))
plans = st.builds(Path, points, ticks)
data = st.dictionaries(st.text(), st.floats() | st.text() | st.none() | st.booleans(), max_size=3)
events = st.lists(st.builds(Event, ticks, st.sampled_from(EventKind), st.text(), data), max_size=2).map(tuple)
decisions = st.builds(Decision, twists, st.none() | beliefs, st.none() | plans, st.none() | plans, events)

odometries = st.builds(Odometry, st.sampled_from(["a", "b"]), ticks, poses, twists)
beams = st.just(np.array([1.0, np.inf, np.nan]))
scans = st.builds(Scan, st.sampled_from(["c", "d"]), ticks, beams, *map(st.just, (0.0, 0.1, 0.0, 9.0)))
readings = st.lists(odometries | scans, max_size=3).map(tuple)

MOST = 6
moments = st.lists(st.builds(Moment, st.just(0), st.none() | truths, readings, decisions, events), max_size=MOST)
gaps = st.lists(st.integers(1, 300), min_size=MOST, max_size=MOST)


def spread(run: list[Moment], apart: list[int]) -> list[Moment]:
    """Return the moments with these intervals in ticks, with the times of their events adapted."""
    return [_at(moment, tick) for moment, tick in zip(run, np.cumsum(apart).tolist(), strict=False)]


def _at(moment: Moment, tick: int) -> Moment:
    own, stack = (
        tuple(dataclasses.replace(event, tick=min(event.tick, tick)) for event in events)
        for events in (moment.events, moment.decision.events)
    )
    return dataclasses.replace(
        moment, tick=tick, events=own, decision=dataclasses.replace(moment.decision, events=stack)
    )


runs = st.builds(spread, moments, gaps)
