"""Reader functions of the named signals, sampled as described in `sampling`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.messages.navigation import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Samples, Ticks
from simscen.criteria.timeline import spans
from simscen.criteria.trace_signals.estimation_errors import BELIEF_TIMEOUT_S, nees_samples, pose_error
from simscen.criteria.trace_signals.ground_truth import Flags, check_samples, drive, speed, teleport_samples, truth
from simscen.criteria.trace_signals.ground_truth import clearance as hull_clearance
from simscen.criteria.trace_signals.ground_truth import turn_rate as unsigned_turn_rate
from simscen.criteria.trace_signals.sampling import (
    SignalArguments,
    SignalQuery,
    SignalUnavailable,
    evenly_spaced,
    hold,
    sample_ticks,
)
from simscen.criteria.trace_signals.sparc_ldlj import CUTOFF_HZ, MIN_RATE_HZ

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

LOCALIZED_STD_M = 0.5
"""Largest standard deviation of the position of a localized robot in m; Nav2's initial value."""


def clearance(query: SignalQuery) -> Array:
    """Return the distance in m to the nearest surface; infinite where nothing is near."""
    return hold(query.trace, hull_clearance(query.trace), "clearance")[:, 0]


def ground_speed(query: SignalQuery) -> Array:
    """Return the true speed over ground in m/s."""
    return hold(query.trace, speed(query.trace), "velocity")[:, 0]


def forward_speed(query: SignalQuery) -> Array:
    """Return the true speed along the robot's x axis in m/s."""
    return _velocity(query.trace)[:, 0]


def turn_rate(query: SignalQuery) -> Array:
    """Return the magnitude of the true turn rate in rad/s."""
    return hold(query.trace, unsigned_turn_rate(query.trace), "velocity")[:, 0]


def yaw_rate(query: SignalQuery) -> Array:
    """Return the true turn rate in rad/s, positive to the left."""
    return _velocity(query.trace)[:, 2]


def acceleration(query: SignalQuery) -> Array:
    """Return the change of the speed over ground since the previous sample, in m/s²."""
    return _differences(query.trace, ground_speed(query), 1)


def angular_acceleration(query: SignalQuery) -> Array:
    """Return the change of the yaw rate since the previous sample, in rad/s²."""
    return _differences(query.trace, yaw_rate(query), 1)


def jerk(query: SignalQuery) -> Array:
    """Return |v[k+1] - 2 v[k] + v[k-1]| / dt² of the speed over ground in m/s³."""
    return np.abs(_differences(query.trace, ground_speed(query), 2))


def evenly_sampled_speed(trace: Trace) -> tuple[Array, float]:
    """Return the true speed over ground in m/s at evenly spaced times, and their rate in Hz.

    Raises SignalUnavailable if there is no velocity, or if the samples are too rare for SPARC and LDLJ.
    """
    even = evenly_spaced(speed(trace), trace.tick_rate)
    rate = trace.tick_rate / float(even.ticks[1] - even.ticks[0])
    if rate < MIN_RATE_HZ:
        raise SignalUnavailable(
            f"the truth has {rate:.1f} samples a second, too few for changes up to {CUTOFF_HZ:g} Hz"
        )
    return even.values[:, 0], rate


def localization_error(query: SignalQuery) -> Array:
    """Return the distance in m between estimated and true position."""
    return hold(query.trace, pose_error(query.trace), "belief")[:, 0]


def localization_yaw_error(query: SignalQuery) -> Array:
    """Return the angle in rad between estimated and true heading."""
    return hold(query.trace, pose_error(query.trace), "belief")[:, 1]


def position_std(query: SignalQuery) -> Array:
    """Return the square root in m of the larger eigenvalue of the covariance of x and y."""
    xx, xy, _, yy, _, _ = _covariance(query.trace).T
    spread = np.hypot((xx - yy) / 2, xy)
    std: Array = np.sqrt(np.maximum((xx + yy) / 2 + spread, 0.0))
    return std


def yaw_std(query: SignalQuery) -> Array:
    """Return the square root in rad of the variance of the heading."""
    return np.sqrt(np.maximum(_covariance(query.trace)[:, 5], 0.0))


def nees(query: SignalQuery) -> Array:
    """Return the NEES of the belief; infinite where the covariance is singular."""
    return hold(query.trace, nees_samples(query.trace), "covariance")[:, 0]


def belief_age(query: SignalQuery) -> Array:
    """Return the time in s since the newest belief was published."""
    return _age(query.trace, query.trace.belief.ticks)


def scan_age(query: SignalQuery) -> Array:
    """Return the time in s since the newest scan was received."""
    return _age(query.trace, query.trace.scans)


def localized(query: SignalQuery) -> Array:
    """Return whether there is a recent belief with a small standard deviation."""
    if not len(query.trace.belief):
        return np.zeros(len(sample_ticks(query.trace)))
    has_belief = sample_ticks(query.trace) >= query.trace.belief.ticks[0]
    is_fresh = belief_age(query) <= BELIEF_TIMEOUT_S
    return _as_numbers(has_belief & is_fresh & (position_std(query) <= LOCALIZED_STD_M))


def goal_distance(query: SignalQuery) -> Array:
    """Return the true distance in m to the current goal."""
    goals, poses = _current_goals(query.trace, query.case), poses_of(query.trace)
    return np.hypot(poses[:, 0] - goals[:, 0], poses[:, 1] - goals[:, 1])


def goal_heading_error(query: SignalQuery) -> Array:
    """Return the angle in rad between the true heading and that of the current goal."""
    return np.abs(wrap_array(poses_of(query.trace)[:, 2] - _current_goals(query.trace, query.case)[:, 2]))


def travelled(query: SignalQuery) -> Array:
    """Return the distance in m driven so far, as path_length measures it."""
    path, clock = drive(query.trace), sample_ticks(query.trace)
    return path.travelled[np.searchsorted(path.ticks, clock, side="right") - 1]


def time(query: SignalQuery) -> Array:
    """Return the simulated time in s."""
    return sample_ticks(query.trace) / query.trace.tick_rate


def command_speed(query: SignalQuery) -> Array:
    """Return the commanded speed in m/s; 0 before the first command."""
    command = _commanded(query.trace)
    return np.hypot(command[:, 0], command[:, 1])


def command_turn_rate(query: SignalQuery) -> Array:
    """Return the magnitude of the commanded turn rate in rad/s; 0 before the first command."""
    return np.abs(_commanded(query.trace)[:, 2])


def in_region(query: SignalQuery) -> Array:
    """Return whether the robot's center is inside the region."""
    name = str(query.arguments["region"])
    if name not in query.case.regions:
        raise SignalUnavailable(f"the world has no region `{name}`")
    return _as_numbers(points_in_polygon(query.case.regions[name], poses_of(query.trace)[:, :2]))


def in_collision(query: SignalQuery) -> Array:
    """Return whether a contact is active."""
    return _as_numbers(
        _between(query.trace, EventKind.COLLISION_STARTED, (EventKind.COLLISION_ENDED,), query.arguments.get("with"))
    )


def goal_active(query: SignalQuery) -> Array:
    """Return whether a goal is active: from its acceptance to the report that ends it."""
    ends = (
        EventKind.GOAL_REACHED,
        EventKind.GOAL_PASSED,
        EventKind.GOAL_FAILED,
        EventKind.GOAL_CANCELED,
        EventKind.NAVIGATION_ENDED,
        EventKind.GOAL_ACCEPTED,
    )
    return _as_numbers(_between(query.trace, EventKind.GOAL_ACCEPTED, ends, query.arguments.get("goal")))


def recovery_active(query: SignalQuery) -> Array:
    """Return whether a recovery is active."""
    return _as_numbers(
        _between(query.trace, EventKind.RECOVERY_STARTED, (EventKind.RECOVERY_ENDED,), query.arguments.get("recovery"))
    )


def is_active(query: SignalQuery) -> Array:
    """Return whether the fault or event is active."""
    intervals = [
        (span.start, span.end + (not span.has_end_event)) for span in spans(query.trace, _label(query.arguments))
    ]
    return _as_numbers(_flags(query.trace, intervals))


def has_just_started(query: SignalQuery) -> Array:
    """Return whether this is the sample that follows a start of the fault or event."""
    starts = [(span.start, span.start) for span in spans(query.trace, _label(query.arguments))]
    return _as_numbers(_flags(query.trace, starts))


def collision_count(query: SignalQuery) -> Array:
    """Return the number of contacts that have begun so far."""
    return _count(query.trace, [event.tick for event in query.trace.of_kind(EventKind.COLLISION_STARTED)])


def replan_count(query: SignalQuery) -> Array:
    """Return the number of plans so far that were made for another reason than a new goal."""
    plans = query.trace.of_kind(EventKind.PLAN_MADE)
    return _count(query.trace, [event.tick for event in plans if event.data.get("reason", "goal") != "goal"])


def recovery_count(query: SignalQuery) -> Array:
    """Return the number of recoveries that have started so far."""
    return _count(query.trace, [event.tick for event in query.trace.of_kind(EventKind.RECOVERY_STARTED)])


def poses_of(trace: Trace) -> Array:
    """Return x and y in m and yaw in rad of the robot in the world frame at each truth sample, (n, 3)."""
    sample_ticks(trace)
    return truth(trace).values


def _velocity(trace: Trace) -> Array:
    return hold(trace, check_samples(trace.velocity, "the true velocity", trace), "velocity")


def _covariance(trace: Trace) -> Array:
    belief = check_samples(trace.belief, "the belief", trace)
    if not len(belief) or belief.values.shape[1] < 9:
        raise SignalUnavailable("no covariance of the belief was recorded")
    return hold(trace, belief, "belief")[:, 3:]


def _commanded(trace: Trace) -> Array:
    clock, command = sample_ticks(trace), check_samples(trace.command, "the command", trace)
    if not len(command):
        raise SignalUnavailable("no command was recorded")
    return np.where((clock >= command.ticks[0])[:, np.newaxis], command.at(clock), 0.0)


def _differences(trace: Trace, values: Array, order: int) -> Array:
    """Return differences of an order divided by the time step to that power; the ends repeat their neighbors.

    Uneven samples are resampled first, and the differences held at the truth's own samples. Teleportation does not
    count as a change.
    """
    ticks = sample_ticks(trace)
    even = evenly_spaced(Samples(ticks, values[:, np.newaxis]), trace.tick_rate)
    if len(even) <= order:
        raise SignalUnavailable(f"the run is too short: {len(even)} samples of the truth")
    step = float(even.ticks[1] - even.ticks[0]) / trace.tick_rate
    first = np.diff(even.values[:, 0]) / step
    placed = [k - 1 for k in teleport_samples(trace, even.ticks) if 0 < k < len(even)]
    first[placed] = 0.0
    if order == 1:
        found = np.concatenate((first[:1], first))
    else:
        second = np.diff(first) / step
        for k in placed:
            second[max(k - 1, 0) : k + 1] = 0.0
        found = np.concatenate((second[:1], second, second[-1:]))
    return Samples(even.ticks, found[:, np.newaxis]).at(ticks)[:, 0]


def _age(trace: Trace, received: Ticks) -> Array:
    """Return the seconds since the newest of these ticks; before the first, since the start."""
    clock = sample_ticks(trace)
    if not len(received):
        return clock / trace.tick_rate
    at = np.searchsorted(received, clock, side="right") - 1
    newest = np.where(at >= 0, received[np.maximum(at, 0)], 0)
    return (clock - newest) / trace.tick_rate


def _current_goals(trace: Trace, case: Case) -> Array:
    """Return x, y, yaw of the goal accepted last, (n, 3); of the first goal, (1, 3), if none was accepted."""
    clock = sample_ticks(trace)
    pose_by_name = {goal.name: goal.pose for goal in reversed(case.every_goal)}
    ticks, poses = [], []
    for event in trace.of_kind(EventKind.GOAL_ACCEPTED):
        pose = tuple(event.data.get(key) for key in ("x", "y", "yaw"))
        known = all(isinstance(part, int | float) for part in pose)
        if known or event.name in pose_by_name:
            ticks.append(event.tick)
            poses.append(pose if known else pose_by_name[event.name])
    if not poses and not case.goals:
        raise SignalUnavailable("there was no goal")
    if not poses:
        return np.array([case.goals[0].pose], dtype=np.float64)
    return Samples(np.array(ticks, dtype=np.int64), np.array(poses, dtype=np.float64)).at(clock)


def _label(arguments: SignalArguments) -> str:
    return str(arguments.get("fault") or arguments["event"])


def _between(trace: Trace, start: EventKind, ends: tuple[EventKind, ...], name: object) -> Flags:
    """Return flags between each event of kind `start` (with `name`, if given) and the next matching one of `ends`."""
    intervals: list[tuple[int, float]] = []
    for event in trace.of_kind(start):
        if name in (None, event.name) or (
            start is EventKind.GOAL_ACCEPTED and matches_goal_name(event.name, str(name))
        ):
            later = (
                e.tick for e in trace.of_kind(*ends) if _is_end(e.kind, e.name, event.name) and e.tick > event.tick
            )
            intervals.append((event.tick, next(later, np.inf)))
    return _flags(trace, intervals)


def _is_end(kind: EventKind, name: str, started: str) -> bool:
    """Return whether an event ends the goal, contact, or recovery `started`; a new goal ends any other goal."""
    return name == started or kind in (EventKind.NAVIGATION_ENDED, EventKind.GOAL_ACCEPTED)


def _flags(trace: Trace, intervals: Iterable[tuple[int, float]]) -> Flags:
    """Return flags that are True from `start` to before `end`, and for at least one sample."""
    clock = sample_ticks(trace)
    flags = np.zeros(len(clock), dtype=bool)
    for start, end in intervals:
        first, last = np.searchsorted(clock, (start, end), side="left").tolist()
        flags[first : max(last, first + 1)] = True
    return flags


def _as_numbers(flags: Flags) -> Array:
    return flags.astype(np.float64)


def _count(trace: Trace, ticks: list[int]) -> Array:
    return np.searchsorted(np.array(sorted(ticks), dtype=np.int64), sample_ticks(trace), side="right").astype(
        np.float64
    )
