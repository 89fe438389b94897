"""What the named signals read off a trace: one value for each truth sample, the clock of every temporal criterion.

What is published more rarely (belief, command, scans) is held from when it came until the next one comes, and its
first value holds before it. What happens between two samples counts at the sample that follows it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import EventKind
from simscen.core.geometry import Array, wrap_array
from simscen.core.goalnames import named
from simscen.core.samples import Samples, Ticks
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.timeline import spans
from simscen.criteria.trace_signals.ground_truth import (
    BELIEF_TIMEOUT_S,
    Flags,
    check_samples,
    drive,
    pose_error,
    speed,
    teleport_samples,
    truth,
)
from simscen.criteria.trace_signals.ground_truth import clearance as hull_clearance
from simscen.criteria.trace_signals.ground_truth import turn_rate as unsigned_turn_rate
from simscen.criteria.trace_signals.nees import nees_samples

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

SignalArguments = Mapping[str, object]
"""What a signal is about: object, point, goal, region, fault, event, recovery or with, as the condition names it."""


@dataclass(frozen=True, eq=False)
class SignalQuery:
    """A run, and what about it is asked."""

    trace: Trace
    case: Case
    of: SignalArguments


LOCALIZED_STD_M = 0.5
"""Metres; a robot whose position has a larger standard deviation does not know where it is (Nav2's at the start)."""


class SignalUnavailable(ValueError):
    """The trace does not hold what a signal is made of: nothing can be decided, and the text says why."""


def clearance(asked: SignalQuery) -> Array:
    """Infinite where nothing is near."""
    return _held(asked.trace, hull_clearance(asked.trace), "clearance")[:, 0]


def ground_speed(asked: SignalQuery) -> Array:
    """Over ground."""
    return _held(asked.trace, speed(asked.trace), "velocity")[:, 0]


def forward_speed(asked: SignalQuery) -> Array:
    """Along the robot's own x axis."""
    return _velocity(asked.trace)[:, 0]


def turn_rate(asked: SignalQuery) -> Array:
    """Without its sign."""
    return _held(asked.trace, unsigned_turn_rate(asked.trace), "velocity")[:, 0]


def yaw_rate(asked: SignalQuery) -> Array:
    """With its sign."""
    return _velocity(asked.trace)[:, 2]


def acceleration(asked: SignalQuery) -> Array:
    """Of the speed over ground, from the sample before."""
    return _changes(asked.trace, ground_speed(asked), 1)


def angular_acceleration(asked: SignalQuery) -> Array:
    """Of the yaw rate, from the sample before."""
    return _changes(asked.trace, yaw_rate(asked), 1)


def jerk(asked: SignalQuery) -> Array:
    """(v[k+1] - 2 v[k] + v[k-1]) / dt^2 of the speed over ground, without its sign."""
    return np.abs(_changes(asked.trace, ground_speed(asked), 2))


def localization_error(asked: SignalQuery) -> Array:
    """Distance between believed and true position."""
    return _held(asked.trace, pose_error(asked.trace), "belief")[:, 0]


def localization_yaw_error(asked: SignalQuery) -> Array:
    """Angle between believed and true heading."""
    return _held(asked.trace, pose_error(asked.trace), "belief")[:, 1]


def position_std(asked: SignalQuery) -> Array:
    """The root of the larger eigenvalue of the covariance of x and y."""
    xx, xy, _, yy, _, _ = _covariance(asked.trace).T
    spread = np.hypot((xx - yy) / 2, xy)
    std: Array = np.sqrt(np.maximum((xx + yy) / 2 + spread, 0.0))
    return std


def yaw_std(asked: SignalQuery) -> Array:
    """The root of the variance of the heading."""
    return np.sqrt(np.maximum(_covariance(asked.trace)[:, 5], 0.0))


def nees(asked: SignalQuery) -> Array:
    """Infinite where the covariance is singular."""
    return _held(asked.trace, nees_samples(asked.trace), "covariance")[:, 0]


def belief_age(asked: SignalQuery) -> Array:
    """Since the newest belief came."""
    return _age(asked.trace, asked.trace.belief.ticks)


def scan_age(asked: SignalQuery) -> Array:
    """Since the newest scan came."""
    return _age(asked.trace, asked.trace.scans)


def localized(asked: SignalQuery) -> Array:
    """There is a fresh belief, and it is a sure one."""
    if not len(asked.trace.belief):
        return np.zeros(len(_clock(asked.trace)))
    begun = _clock(asked.trace) >= asked.trace.belief.ticks[0]
    fresh = belief_age(asked) <= BELIEF_TIMEOUT_S
    return _truths(begun & fresh & (position_std(asked) <= LOCALIZED_STD_M))


def goal_distance(asked: SignalQuery) -> Array:
    """From the true position."""
    goals, poses = _current_goals(asked.trace, asked.case), poses_of(asked.trace)
    return np.hypot(poses[:, 0] - goals[:, 0], poses[:, 1] - goals[:, 1])


def goal_heading_error(asked: SignalQuery) -> Array:
    """From the true heading."""
    return np.abs(wrap_array(poses_of(asked.trace)[:, 2] - _current_goals(asked.trace, asked.case)[:, 2]))


def travelled(asked: SignalQuery) -> Array:
    """As path_length measures it."""
    way, clock = drive(asked.trace), _clock(asked.trace)
    return way.travelled[np.searchsorted(way.ticks, clock, side="right") - 1]


def time(asked: SignalQuery) -> Array:
    """Simulated."""
    return _clock(asked.trace) / asked.trace.tick_rate


def command_speed(asked: SignalQuery) -> Array:
    """As sent to the wheels; none before the first command."""
    command = _commanded(asked.trace)
    return np.hypot(command[:, 0], command[:, 1])


def command_turn_rate(asked: SignalQuery) -> Array:
    """As sent to the wheels, without its sign."""
    return np.abs(_commanded(asked.trace)[:, 2])


def in_region(asked: SignalQuery) -> Array:
    """The robot's centre is inside."""
    name = str(asked.of["region"])
    if name not in asked.case.regions:
        raise SignalUnavailable(f"the world has no region `{name}`")
    return _truths(
        points_in_polygon(poses_of(asked.trace)[:, :2], np.array(asked.case.regions[name], dtype=np.float64))
    )


def in_collision(asked: SignalQuery) -> Array:
    """Between the begin and the end of a contact."""
    return _truths(
        _between(asked.trace, EventKind.COLLISION_STARTED, (EventKind.COLLISION_ENDED,), asked.of.get("with"))
    )


def goal_active(asked: SignalQuery) -> Array:
    """From acceptance to the report that ends it."""
    ends = (
        EventKind.GOAL_REACHED,
        EventKind.GOAL_PASSED,
        EventKind.GOAL_FAILED,
        EventKind.GOAL_CANCELED,
        EventKind.NAVIGATION_ENDED,
        EventKind.GOAL_ACCEPTED,
    )
    return _truths(_between(asked.trace, EventKind.GOAL_ACCEPTED, ends, asked.of.get("goal")))


def recovery_active(asked: SignalQuery) -> Array:
    """Between its begin and its end."""
    return _truths(
        _between(asked.trace, EventKind.RECOVERY_STARTED, (EventKind.RECOVERY_ENDED,), asked.of.get("recovery"))
    )


def is_active(asked: SignalQuery) -> Array:
    """While the fault or event lasts."""
    stretches = [(span.start, span.end + (not span.lasting)) for span in spans(asked.trace, _happening(asked.of))]
    return _truths(_stretches(asked.trace, stretches))


def has_just_started(asked: SignalQuery) -> Array:
    """At the one sample that follows each start."""
    starts = [(span.start, span.start) for span in spans(asked.trace, _happening(asked.of))]
    return _truths(_stretches(asked.trace, starts))


def collision_count(asked: SignalQuery) -> Array:
    """Contacts that began."""
    return _count(asked.trace, [event.tick for event in asked.trace.of_kind(EventKind.COLLISION_STARTED)])


def replan_count(asked: SignalQuery) -> Array:
    """Plans made for another reason than a new goal."""
    plans = asked.trace.of_kind(EventKind.PLAN_MADE)
    return _count(asked.trace, [event.tick for event in plans if event.data.get("reason", "goal") != "goal"])


def recovery_count(asked: SignalQuery) -> Array:
    """Recoveries that began."""
    return _count(asked.trace, [event.tick for event in asked.trace.of_kind(EventKind.RECOVERY_STARTED)])


def points_in_polygon(points: Array, corners: Array) -> Flags:
    """Whether each of `points` (n, 2) is inside a polygon (m, 2), by the number of edges a ray to the right crosses.

    Of its border, left and below belong to it: of regions side by side, each place is in one.
    """
    x, y = points[:, :1], points[:, 1:]
    others = np.roll(corners, 1, axis=0)
    crosses = (corners[:, 1] > y) != (others[:, 1] > y)
    rise = np.where(corners[:, 1] == others[:, 1], np.inf, others[:, 1] - corners[:, 1])
    right = x < corners[:, 0] + (y - corners[:, 1]) / rise * (others[:, 0] - corners[:, 0])
    odd: Flags = (crosses & right).sum(axis=1) % 2 == 1
    return odd


def _clock(trace: Trace) -> Ticks:
    if not len(trace.truth):
        raise SignalUnavailable("the true pose was not recorded")
    return trace.truth.ticks


def poses_of(trace: Trace) -> Array:
    """x, y, yaw of the robot at each truth sample."""
    _clock(trace)
    return truth(trace).values


def _held(trace: Trace, samples: Samples, what: str) -> Array:
    """The newest value at each truth sample."""
    clock = _clock(trace)
    if not len(samples):
        raise SignalUnavailable(f"no {what} was recorded")
    return samples.at(clock)


def _velocity(trace: Trace) -> Array:
    return _held(trace, check_samples(trace.velocity, "the true velocity", trace), "velocity")


def _covariance(trace: Trace) -> Array:
    belief = check_samples(trace.belief, "the belief", trace)
    if not len(belief) or belief.values.shape[1] < 9:
        raise SignalUnavailable("no covariance of the belief was recorded")
    return _held(trace, belief, "belief")[:, 3:]


def _commanded(trace: Trace) -> Array:
    clock, command = _clock(trace), check_samples(trace.command, "the command", trace)
    if not len(command):
        raise SignalUnavailable("no command was recorded")
    return np.where((clock >= command.ticks[0])[:, np.newaxis], command.at(clock), 0.0)


def _changes(trace: Trace, values: Array, order: int) -> Array:
    """Differences of an order by dt to that power; the ends repeat their neighbours. Being set down is no change."""
    clock = _clock(trace)
    if len(clock) <= order:
        raise SignalUnavailable(f"the run is too short: {len(clock)} samples of the truth")
    periods = np.diff(clock)
    if (periods != periods[0]).any():
        raise InvalidTrace("the samples of the truth are not evenly spaced")
    step = float(periods[0]) / trace.tick_rate
    first = np.diff(values) / step
    placed = [k - 1 for k in teleport_samples(trace) if 0 < k < len(values)]
    first[placed] = 0.0
    if order == 1:
        return np.concatenate((first[:1], first))
    second = np.diff(first) / step
    for k in placed:
        second[max(k - 1, 0) : k + 1] = 0.0
    return np.concatenate((second[:1], second, second[-1:]))


def _age(trace: Trace, came: Ticks) -> Array:
    """Seconds since the newest of these ticks; since the start before the first."""
    clock = _clock(trace)
    if not len(came):
        return clock / trace.tick_rate
    at = np.searchsorted(came, clock, side="right") - 1
    newest = np.where(at >= 0, came[np.maximum(at, 0)], 0)
    return (clock - newest) / trace.tick_rate


def _current_goals(trace: Trace, case: Case) -> Array:
    """x, y, yaw of the goal accepted last, (n, 3); of the first one, (1, 3), when none ever is."""
    clock = _clock(trace)
    named = {goal.name: goal.pose for goal in reversed(case.every_goal)}
    ticks, poses = [], []
    for event in trace.of_kind(EventKind.GOAL_ACCEPTED):
        pose = tuple(event.data.get(key) for key in ("x", "y", "yaw"))
        known = all(isinstance(part, int | float) for part in pose)
        if known or event.name in named:
            ticks.append(event.tick)
            poses.append(pose if known else named[event.name])
    if not poses and not case.goals:
        raise SignalUnavailable("there was no goal")
    if not poses:
        return np.array([case.goals[0].pose], dtype=np.float64)
    return Samples(np.array(ticks, dtype=np.int64), np.array(poses, dtype=np.float64)).at(clock)


def _happening(of: SignalArguments) -> str:
    return str(of.get("fault") or of["event"])


def _between(trace: Trace, start: EventKind, ends: tuple[EventKind, ...], name: object) -> Flags:
    """From each event of the kind `start` (of that name, if one is given) to the next of `ends` under its name."""
    stretches: list[tuple[int, float]] = []
    for event in trace.of_kind(start):
        if name in (None, event.name) or (start is EventKind.GOAL_ACCEPTED and named(event.name, str(name))):
            later = (e.tick for e in trace.of_kind(*ends) if _ends(e.kind, e.name, event.name) and e.tick > event.tick)
            stretches.append((event.tick, next(later, np.inf)))
    return _stretches(trace, stretches)


def _ends(kind: EventKind, name: str, begun: str) -> bool:
    """A task ends every goal, and so does the goal that takes its place; all else ends what bears its name."""
    return name == begun or kind in (EventKind.NAVIGATION_ENDED, EventKind.GOAL_ACCEPTED)


def _stretches(trace: Trace, stretches: Iterable[tuple[int, float]]) -> Flags:
    """True from `start` to before `end`, and at the next sample at least."""
    clock = _clock(trace)
    flags = np.zeros(len(clock), dtype=bool)
    for start, end in stretches:
        first, last = np.searchsorted(clock, (start, end), side="left").tolist()
        flags[first : max(last, first + 1)] = True
    return flags


def _truths(flags: Flags) -> Array:
    return flags.astype(np.float64)


def _count(trace: Trace, ticks: list[int]) -> Array:
    return np.searchsorted(np.array(sorted(ticks), dtype=np.int64), _clock(trace), side="right").astype(np.float64)
