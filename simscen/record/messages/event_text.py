"""Events as JSON, and as lines a person reads in a log panel."""

import json
from typing import Any

from simscen.core.records.events import Event, EventKind

INFO, WARN, ERROR = 20, 30, 40
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
    """One line; numbers survive exactly. What JSON lacks (infinity, nan) is written as Python's json writes it."""
    record = {"tick": event.tick, "kind": event.kind, "name": event.name, "data": dict(event.data)}
    return json.dumps(record, separators=(",", ":"))


def from_json(text: str) -> Event:
    """The event that `to_json` wrote. Raises ValueError or KeyError when it is none."""
    record: dict[str, Any] = json.loads(text)
    return Event(int(record["tick"]), EventKind(record["kind"]), str(record["name"]), dict(record["data"]))


def level(event: Event) -> int:
    """The severity for /rosout, in rcl_interfaces/msg/Log's numbers."""
    return _LEVELS.get(event.kind, INFO)


def sentence(event: Event) -> str:
    """The event in one line, e.g. "goal.failed shelf: error_code=208"."""
    head = f"{event.kind} {event.name}".rstrip()
    details = ", ".join(f"{key}={_short(value)}" for key, value in event.data.items())
    return f"{head}: {details}" if details else head


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
