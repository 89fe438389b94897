"""What happened, in the lanes of a timeline: moments, and stretches from their begin to their end."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.judge.run_result import OF_ALL
from simscen.report.replay.lines import Lines
from simscen.report.text import one_line

K = EventKind
_LANES = {
    K.GOAL_ACCEPTED: "goals", K.GOAL_REACHED: "goals", K.GOAL_PASSED: "goals", K.GOAL_FAILED: "failures",
    K.GOAL_CANCELED: "goals", K.NAVIGATION_ENDED: "goals", K.PLAN_MADE: "plans", K.PLAN_FAILED: "plans",
    K.RECOVERY_STARTED: "recoveries", K.RECOVERY_ENDED: "recoveries", K.COLLISION_STARTED: "failures",
    K.COLLISION_ENDED: "failures", K.FAULT_STARTED: "faults", K.FAULT_TOOK_EFFECT: "faults", K.FAULT_ENDED: "faults",
    K.ROBOT_HELD: "recoveries", K.ROBOT_RELEASED: "recoveries",
}  # fmt: skip
_PAIRS = {
    K.GOAL_ACCEPTED: (K.GOAL_REACHED, K.GOAL_PASSED, K.GOAL_FAILED, K.GOAL_CANCELED),
    K.RECOVERY_STARTED: (K.RECOVERY_ENDED,),
    K.ROBOT_HELD: (K.ROBOT_RELEASED,),
    K.COLLISION_STARTED: (K.COLLISION_ENDED,),
    K.FAULT_STARTED: (K.FAULT_ENDED,),
    K.EVENT_STARTED: (K.EVENT_ENDED,),
}
"""What begins a stretch, and what ends it."""
_BAD = {K.GOAL_FAILED, K.COLLISION_STARTED, K.PLAN_FAILED}
_QUIET = {"tick", "entry", "parts", "points", "waypoints", "times", "index", "effects"}
"""Data of events that say nothing to people, or are said otherwise."""


@dataclass(frozen=True)
class Happened:
    """One thing in a lane: `until` is set for what lasts, `line` is where the scenario asks for it (0 = nowhere)."""

    tick: int
    kind: str
    lane: str
    name: str
    text: str
    until: int | None = None
    ended: str = ""
    bad: bool = False
    line: int = 0
    place: Sequence[float] = field(default=())
    about: Mapping[str, Any] = field(default_factory=dict)

    def as_data(self, robot: str) -> dict[str, Any]:
        """As JSON holds it."""
        told = {"tick": self.tick, "kind": self.kind, "lane": self.lane, "name": self.name, "text": self.text}
        more: dict[str, Any] = {"until": self.until, "ended": self.ended, "bad": self.bad, "line": self.line}
        more |= {"place": self.place, "about": self.about}
        return told | {key: value for key, value in more.items() if value} | ({"robot": robot} if robot else {})


def happened(trace: Trace, lines: Lines, shared: bool) -> list[Happened]:
    """All events of a robot in their order; with `shared`, also what happens to the world."""
    found: list[Happened] = []
    open_: dict[tuple[EventKind, str], int] = {}
    for event in trace.events:
        if _of_all(event) and not shared:
            continue
        for begin, ends in _PAIRS.items():
            place = open_.pop((begin, event.name), None) if event.kind in ends else None
            if place is not None:
                found[place] = replace(found[place], until=event.tick, ended=str(event.kind))
        if event.kind in _PAIRS:
            open_[event.kind, event.name] = len(found)
        found.append(_told(event, lines))
    for place in open_.values():
        found[place] = replace(found[place], until=trace.end)
    return found


def _of_all(event: Event) -> bool:
    return str(event.kind).startswith(OF_ALL) and event.kind != EventKind.RUN_ENDED


def _told(event: Event, lines: Lines) -> Happened:
    x, y = event.data.get("x"), event.data.get("y")
    place = (round(float(x), 3), round(float(y), 3)) if _number(x) and _number(y) else ()  # type: ignore[arg-type]
    details = ", ".join(_details(event))
    return Happened(
        tick=event.tick,
        kind=str(event.kind),
        lane=_LANES.get(event.kind, "events"),
        name=one_line(event.name),
        text=one_line(details),
        bad=event.kind in _BAD,
        line=_line(event, lines),
        place=place,
        about=event.data if event.kind == K.ZONE_SWITCHED else {},
    )


def _details(event: Event) -> Iterator[str]:
    effects = event.data.get("effects")
    if isinstance(effects, list):
        yield from (str(one["what"]) for one in effects if isinstance(one, dict) and one.get("what"))
    for key, value in event.data.items():
        if key not in _QUIET and value not in ("", None) and not isinstance(value, list | dict):
            yield f"{key.replace('_', ' ')} {_short(value)}"


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _line(event: Event, lines: Lines) -> int:
    entry = event.data.get("entry")
    if isinstance(entry, int):
        return (lines.faults if str(event.kind).startswith("fault.") else lines.events).get(entry, 0)
    if str(event.kind).startswith("goal."):
        return lines.goals.get(event.name, lines.goals.get(event.name.rpartition("#")[0], 0))
    return 0
