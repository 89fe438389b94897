"""Conversion of the states of goals that an action server publishes to events of goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from simscen.core.records.events import Event, EventKind
from simscen.record.messages.decode import GoalState

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Values of action_msgs/msg/GoalStatus."""
_FINAL_STATES = {
    SUCCEEDED: (EventKind.GOAL_REACHED, "SUCCEEDED"),
    CANCELED: (EventKind.GOAL_CANCELED, "CANCELED"),
    ABORTED: (EventKind.GOAL_FAILED, "FAILED"),
}
"""Event of a goal, and result of a navigation with only this goal, by the final status of the goal."""


def goal_events(messages: Sequence[tuple[int, list[GoalState]]], names: Sequence[str]) -> list[Event] | str:
    """Return the events of goals, or the reason why the events are unknown.

    `messages` are pairs of a tick and the states of all goals at this tick. `names` are the names of the goals in the
    order in which the goals were accepted. Goals that ended before the start of the log are ignored.
    """
    accept_ticks: dict[bytes, int] = {}
    ends: dict[bytes, tuple[int, int]] = {}
    ignored_goals: set[bytes] = set()
    for message_index, (tick, states) in enumerate(messages):
        for state in states:
            if message_index == 0 and state.status in _FINAL_STATES:
                ignored_goals.add(state.id)
            if state.id in ignored_goals:
                continue
            accept_ticks.setdefault(state.id, tick)
            if state.status in _FINAL_STATES:
                ends.setdefault(state.id, (tick, state.status))
    if len(accept_ticks) != len(names):
        return f"the log has {_count_text(len(accept_ticks))}, the scenario {_count_text(len(names))}"
    events = []
    for name, (goal_id, tick) in zip(names, accept_ticks.items(), strict=True):
        events.append(Event(tick, EventKind.GOAL_ACCEPTED, name))
        if goal_id in ends:
            end_tick, status = ends[goal_id]
            events.append(Event(end_tick, _FINAL_STATES[status][0], name))
    events += _navigation_ends(list(accept_ticks.values()), [ends.get(goal_id) for goal_id in accept_ticks])
    return sorted(events, key=lambda event: event.tick)


def _navigation_ends(accept_ticks: Sequence[int], ends: Sequence[tuple[int, int] | None]) -> Iterator[Event]:
    """Yield the ends of navigation, with the results that the reference stack would report.

    `accept_ticks` are the ticks at which the goals were accepted. `ends` are the tick and the final status at the end
    of each goal; None for a goal that has not ended. Navigation ends with the last goal. It also ends with a canceled
    goal if the next goal is accepted later. Navigation has failed if one of its goals failed.
    """
    has_failed = False
    for index, end in enumerate(ends):
        if end is None:
            return
        tick, status = end
        has_failed = has_failed or status == ABORTED
        if index == len(ends) - 1 or (status == CANCELED and tick <= accept_ticks[index + 1]):
            result = ABORTED if has_failed and status != CANCELED else status
            yield Event(tick, EventKind.NAVIGATION_ENDED, _FINAL_STATES[result][1])
            has_failed = False


def _count_text(count: int) -> str:
    return f"{count} goal" if count == 1 else f"{count} goals"
