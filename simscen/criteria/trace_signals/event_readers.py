"""Readers of signals about recorded events: goals, collisions, recoveries, replans, faults, and events.

Each function returns the values (n,) of a signal at the n samples of the truth; 0 or 1 for a yes-or-no signal.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.messages.goals import goal_without_loop, matches_goal_name
from simscen.core.records.events import GOAL_END_KINDS, Event, EventKind
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.timeline import spans
from simscen.criteria.trace_signals.sampling import SignalQuery, sample_ticks

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


def in_collision(query: SignalQuery) -> Array:
    """Return whether the robot touches the object of the query; without an object, whether it touches anything.

    Raises MissingEvidence if there is no such object.
    """
    start, end = EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED
    name = query.arguments.get("with")
    if name is not None:
        require_object(query.case, str(name))
    return _active_between_events(query.trace, start, (end,), name)


def require_object(case: Case, name: str) -> None:
    """Raise MissingEvidence if `case.objects` is known and does not contain an object with this name."""
    if case.objects is not None and name not in case.objects:
        raise MissingEvidence(f"neither the log nor the world of the criteria file has an object `{name}`")


def goal_active(query: SignalQuery) -> Array:
    """Return whether the goal of the query (without one: any goal) is active: accepted, and not yet ended.

    Raises MissingEvidence if the scenario has no such goal, or if the stack accepted none of the scenario's goals.
    """
    name = query.arguments.get("goal")
    accepted = query.trace.of_kind(EventKind.GOAL_ACCEPTED)
    names = [*(goal.name for goal in query.case.every_goal), *(event.name for event in accepted)]
    if name is not None and goal_without_loop(str(name)) not in map(goal_without_loop, names):
        raise MissingEvidence(f"the scenario has no goal `{name}`")
    if query.case.goals and not accepted:
        raise MissingEvidence("the stack did not report that it accepted a goal")
    ends = (*GOAL_END_KINDS, EventKind.NAVIGATION_ENDED, EventKind.GOAL_ACCEPTED)
    return _active_between_events(query.trace, EventKind.GOAL_ACCEPTED, ends, name)


def recovery_active(query: SignalQuery) -> Array:
    """Return whether the recovery behavior of the query (without one: any recovery behavior) is active.

    Raises MissingEvidence under the same conditions as `recoveries`.
    """
    recoveries(query.trace, query.case)
    start, end = EventKind.RECOVERY_STARTED, EventKind.RECOVERY_ENDED
    return _active_between_events(query.trace, start, (end,), query.arguments.get("recovery"))


def is_active(query: SignalQuery) -> Array:
    """Return whether the fault or event of the query is active.

    Raises MissingEvidence if the scenario has no such fault or event.
    """
    active = spans(query.trace, _label(query))
    return _active_in_intervals(query.trace, [(span.start, span.end + (not span.has_end_event)) for span in active])


def has_just_started(query: SignalQuery) -> Array:
    """Return whether the fault or event of the query has started since the previous sample.

    Raises MissingEvidence if the scenario has no such fault or event.
    """
    starts = [(span.start, span.start) for span in spans(query.trace, _label(query))]
    return _active_in_intervals(query.trace, starts)


def collision_count(query: SignalQuery) -> Array:
    """Return the number of contacts that have begun so far."""
    return _count_until_samples(query.trace, query.trace.of_kind(EventKind.COLLISION_STARTED))


def replan_count(query: SignalQuery) -> Array:
    """Return the number of plans that were made so far for another reason than a new goal."""
    return _count_until_samples(query.trace, replans(query.trace))


def replans(trace: Trace) -> list[Event]:
    """Return the events of plans that were made for another reason than a new goal.

    Raises MissingEvidence if the stack did not report the reason of a plan, or if it reported a reached goal without
    any plan.
    """
    plans = trace.of_kind(EventKind.PLAN_MADE)
    if (trace.plans and not plans) or any("reason" not in plan.data for plan in plans):
        raise MissingEvidence("the stack did not report why it made its plans")
    if not plans and trace.of_kind(EventKind.GOAL_REACHED, EventKind.GOAL_PASSED):
        raise MissingEvidence("the stack reported no plan, although it reached a goal")
    return [plan for plan in plans if plan.data["reason"] != "goal"]


def recovery_count(query: SignalQuery) -> Array:
    """Return the number of recoveries that have started so far."""
    return _count_until_samples(query.trace, recoveries(query.trace, query.case))


def recoveries(trace: Trace, case: Case) -> list[Event]:
    """Return the events of recoveries that started.

    Raises MissingEvidence if the stack reported neither a recovery nor the acceptance of a goal.
    """
    reported = trace.of_kind(EventKind.RECOVERY_STARTED, EventKind.GOAL_ACCEPTED)
    if case.goals and not reported:
        raise MissingEvidence("the stack reported neither goals nor recoveries")
    return [event for event in reported if event.kind == EventKind.RECOVERY_STARTED]


def _label(query: SignalQuery) -> str:
    """Return the name of the fault or event in the arguments.

    Raises MissingEvidence if the scenario has no such fault or event.
    """
    kind = "fault" if query.arguments.get("fault") else "event"
    label = str(query.arguments[kind])
    if query.case.labels is not None and label not in query.case.labels:
        raise MissingEvidence(f"the scenario has no {kind} `{label}`")
    return label


def _active_between_events(
    trace: Trace, start_kind: EventKind, end_kinds: tuple[EventKind, ...], name: object
) -> Array:
    """Return 1 (n,) for the samples between each start event and the event that ends it, and 0 for the others.

    `name` is the name of the start events; None for any name.
    """
    intervals: list[tuple[int, float]] = []
    active: list[Event] = []  # start events that have not ended
    for event in trace.of_kind(start_kind, *end_kinds):
        if event.kind in end_kinds:
            intervals += [(start.tick, event.tick) for start in active if _ends(event, start)]
            active = [start for start in active if not _ends(event, start)]
        is_goal = start_kind is EventKind.GOAL_ACCEPTED
        has_name = name in (None, event.name) or (is_goal and matches_goal_name(event.name, str(name)))
        if event.kind == start_kind and has_name:
            active.append(event)
    return _active_in_intervals(trace, [*intervals, *((start.tick, np.inf) for start in active)])


def _ends(event: Event, start: Event) -> bool:
    """Return whether a later event ends the goal, contact, or recovery that began with the event `start`."""
    if event.kind == EventKind.GOAL_ACCEPTED:
        return event.tick > start.tick  # the poses of one action can be accepted at the same tick
    return event.name == start.name or event.kind == EventKind.NAVIGATION_ENDED


def _active_in_intervals(trace: Trace, intervals: Iterable[tuple[int, float]]) -> Array:
    """Return 1 (n,) for the samples in the intervals, and 0 for the others.

    An interval is a pair (start, end) in ticks, without its end. If it contains no sample, the next sample gets 1.
    """
    clock = sample_ticks(trace)
    active = np.zeros(len(clock))
    for start, end in intervals:
        first, last = np.searchsorted(clock, (start, end), side="left").tolist()
        active[first : max(last, first + 1)] = 1.0
    return active


def _count_until_samples(trace: Trace, events: Iterable[Event]) -> Array:
    """Return the number (n,) of events up to each sample."""
    ticks = np.array(sorted(event.tick for event in events), dtype=np.int64)
    return np.searchsorted(ticks, sample_ticks(trace), side="right").astype(np.float64)
