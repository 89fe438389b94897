"""What became of goals, as a navigation action's status topic tells it."""

from collections.abc import Sequence

from simscen.core.records.events import Event, EventKind
from simscen.record.foreign.messages import GoalState

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/msg/GoalStatus."""
_ENDS = {
    SUCCEEDED: (EventKind.GOAL_REACHED, "SUCCEEDED"),
    CANCELED: (EventKind.GOAL_CANCELED, "CANCELED"),
    ABORTED: (EventKind.GOAL_FAILED, "FAILED"),
}


def events_of(told: Sequence[tuple[int, list[GoalState]]], names: Sequence[str]) -> list[Event] | str:
    """The goals' events from (tick, states), where the k-th goal of the log is the k-th of `names`; or why not.

    A goal that had ended before the log began is not of this log.
    """
    accepted: dict[bytes, int] = {}
    ended: dict[bytes, tuple[int, int]] = {}
    earlier: set[bytes] = set()
    for number, (tick, states) in enumerate(told):
        for state in states:
            if number == 0 and state.status in _ENDS:
                earlier.add(state.id)
            if state.id in earlier:
                continue
            accepted.setdefault(state.id, tick)
            if state.status in _ENDS:
                ended.setdefault(state.id, (tick, state.status))
    if len(accepted) != len(names):
        return f"the log has {_count(len(accepted))}, the scenario {_count(len(names))}"
    events = [
        event
        for name, (identity, tick) in zip(names, accepted.items(), strict=True)
        for event in _story(name, tick, ended.get(identity))
    ]
    last = [ended.get(identity) for identity in accepted][-1:]
    if len(ended) == len(accepted) and last and last[0] is not None:
        events.append(Event(last[0][0], EventKind.NAVIGATION_ENDED, _ENDS[last[0][1]][1]))
    return sorted(events, key=lambda event: event.tick)


def _story(name: str, accepted: int, ended: tuple[int, int] | None) -> list[Event]:
    events = [Event(accepted, EventKind.GOAL_ACCEPTED, name)]
    return [*events, *([] if ended is None else [Event(ended[0], _ENDS[ended[1]][0], name)])]


def _count(number: int) -> str:
    return f"{number} goal" if number == 1 else f"{number} goals"
