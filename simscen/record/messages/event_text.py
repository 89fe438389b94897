"""Conversion of events to text: JSON for /simscen/events, and readable lines for /rosout."""

import json
from typing import Any

from simscen.core.records.events import Event, EventKind

EVENT_LOGGER = "simscen"
"""Logger name of events on /rosout."""
INFO, WARN, ERROR = 20, 30, 40
"""Levels of rcl_interfaces/msg/Log."""
_LEVELS = {
    EventKind.GOAL_FAILED: ERROR,
    EventKind.COLLISION_STARTED: ERROR,
    EventKind.GOAL_CANCELED: WARN,
    EventKind.PLAN_FAILED: WARN,
    EventKind.RECOVERY_STARTED: WARN,
    EventKind.ROBOT_HELD: WARN,
    EventKind.FAULT_STARTED: WARN,
}


def to_json(event: Event) -> str:
    """Return an event as one line of JSON. Infinity and nan become `Infinity` and `NaN`, as usual in Python's json."""
    record = {"tick": event.tick, "kind": event.kind, "name": event.name, "data": dict(event.data)}
    return json.dumps(record, separators=(",", ":"))


def from_json(text: str) -> Event:
    """Parse the text of `to_json`. Raises ValueError or KeyError for other text."""
    record: dict[str, Any] = json.loads(text)
    return Event(int(record["tick"]), EventKind(record["kind"]), str(record["name"]), dict(record["data"]))


def level(event: Event) -> int:
    """Return the level of an event on /rosout: INFO, WARN, or ERROR."""
    return _LEVELS.get(event.kind, INFO)


def log_text(event: Event) -> str:
    """Return an event as one readable line, for example "goal.failed shelf: error_code=208"."""
    head = f"{event.kind} {event.name}".rstrip()
    details = ", ".join(f"{key}={_short_text(value)}" for key, value in event.data.items())
    return f"{head}: {details}" if details else head


def _short_text(value: object) -> str:
    """Return a value as text, with four significant digits if it is a float."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
