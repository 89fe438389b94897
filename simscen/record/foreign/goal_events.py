"""Events of goals from the states of goals that an action server publishes."""

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
"""Event of a goal, and result of a navigation with this goal alone, by the final status of the goal."""


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
    events += _navigation_ends(list(accepted.values()), [ended.get(goal_id) for goal_id in accepted])
    return sorted(events, key=lambda event: event.tick)


def _navigation_ends(starts: Sequence[int], ends: Sequence[tuple[int, int] | None]) -> Iterator[Event]:
    """Yield the ends of navigation, with the results that simscen's own stack would report.

    `starts` and `ends` are the ticks at which the goals were accepted, and their ticks and final statuses. Navigation
    ends with the last goal, and with a canceled goal before the next one is accepted. It has failed if a goal failed.
    """
    has_failed = False
    for index, end in enumerate(ends):
        if end is None:
            return
        tick, status = end
        has_failed = has_failed or status == ABORTED
        if index == len(ends) - 1 or (status == CANCELED and tick <= starts[index + 1]):
            result = ABORTED if has_failed and status != CANCELED else status
            yield Event(tick, EventKind.NAVIGATION_ENDED, _FINAL_STATES[result][1])
            has_failed = False


def _count(number: int) -> str:
    return f"{number} goal" if number == 1 else f"{number} goals"
