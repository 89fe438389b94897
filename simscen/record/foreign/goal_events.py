"""Events of goals from the states of goals that an action server publishes."""

from __future__ import annotations

from collections.abc import Sequence

from simscen.core.records.events import Event, EventKind
from simscen.record.messages.decode import GoalState

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Values of action_msgs/msg/GoalStatus."""
_FINAL_STATES = {
    SUCCEEDED: (EventKind.GOAL_REACHED, "SUCCEEDED"),
    CANCELED: (EventKind.GOAL_CANCELED, "CANCELED"),
    ABORTED: (EventKind.GOAL_FAILED, "FAILED"),
}
"""Event of a goal, and result of the navigation after the last goal, by the final status of the goal."""


def goal_events(messages: Sequence[tuple[int, list[GoalState]]], names: Sequence[str]) -> list[Event] | str:
    """Return the events of goals, or the reason why they are unknown.

    `messages` are ticks and states of all goals. `names` are the names of the goals in the order of their acceptance.
    Goals that ended before the start of the log are ignored.
    """
    accepted: dict[bytes, int] = {}
    ended: dict[bytes, tuple[int, int]] = {}
    ignored: set[bytes] = set()
    for number, (tick, states) in enumerate(messages):
        for state in states:
            if number == 0 and state.status in _FINAL_STATES:
                ignored.add(state.id)
            if state.id in ignored:
                continue
            accepted.setdefault(state.id, tick)
            if state.status in _FINAL_STATES:
                ended.setdefault(state.id, (tick, state.status))
    if len(accepted) != len(names):
        return f"the log has {_count(len(accepted))}, the scenario {_count(len(names))}"
    events = []
    for name, (goal_id, tick) in zip(names, accepted.items(), strict=True):
        events.append(Event(tick, EventKind.GOAL_ACCEPTED, name))
        if goal_id in ended:
            end_tick, status = ended[goal_id]
            events.append(Event(end_tick, _FINAL_STATES[status][0], name))
    if accepted and len(ended) == len(accepted):
        end_tick, status = ended[list(accepted)[-1]]
        events.append(Event(end_tick, EventKind.NAVIGATION_ENDED, _FINAL_STATES[status][1]))
    return sorted(events, key=lambda event: event.tick)


def _count(number: int) -> str:
    return f"{number} goal" if number == 1 else f"{number} goals"
