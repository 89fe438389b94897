"""What happened, in the lanes of a timeline: moments, and stretches from their begin to their end."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Verdict
from simscen.judge.finding_text import DISTURBANCE, comparison, disturbance_times, subject
from simscen.judge.run_result import OF_ALL
from simscen.report.display_text import one_line
from simscen.report.replay.source_lines import SourceLines

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
class TimelineEntry:
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


def timeline_entries(trace: Trace, lines: SourceLines, shared: bool) -> list[TimelineEntry]:
    """All events of a robot in their order; with `shared`, also what happens to the world."""
    found: list[TimelineEntry] = []
    open_: dict[tuple[EventKind, str], int] = {}
    for event in trace.events:
        if _is_shared(event) and not shared:
            continue
        for begin, ends in _PAIRS.items():
            place = open_.pop((begin, event.name), None) if event.kind in ends else None
            if place is not None:
                found[place] = replace(found[place], until=event.tick, ended=str(event.kind))
        if event.kind in _PAIRS:
            open_[event.kind, event.name] = len(found)
        found.append(_entry(event, lines))
    for place in open_.values():
        found[place] = replace(found[place], until=trace.end)
    return found


def _is_shared(event: Event) -> bool:
    return str(event.kind).startswith(OF_ALL) and event.kind != EventKind.RUN_ENDED


def _entry(event: Event, lines: SourceLines) -> TimelineEntry:
    x, y = event.data.get("x"), event.data.get("y")
    place = (round(float(x), 3), round(float(y), 3)) if _number(x) and _number(y) else ()  # type: ignore[arg-type]
    details = ", ".join(_details(event))
    return TimelineEntry(
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


def _line(event: Event, lines: SourceLines) -> int:
    entry = event.data.get("entry")
    if isinstance(entry, int):
        return (lines.faults if str(event.kind).startswith("fault.") else lines.events).get(entry, 0)
    if str(event.kind).startswith("goal."):
        return lines.goals.get(event.name, lines.goals.get(event.name.rpartition("#")[0], 0))
    return 0


def verdict_data(result: RunResult, lines: dict[str, SourceLines]) -> list[dict[str, Any]]:
    """All verdicts in their order; of several robots each with its robot."""
    return [_verdict(verdict, result, lines) for verdict in result.verdicts]


def disturbance_data(result: RunResult, lines: dict[str, SourceLines]) -> list[dict[str, Any]]:
    """Each event and fault of the scenario: when it began, and what it changed."""
    told, numbers = [], {"event": 0, "fault": 0}
    first = next(iter(lines.values()))
    for one in result.disturbances:
        number = numbers[one.ordered.kind]
        numbers[one.ordered.kind] += 1
        known = first.events if one.ordered.kind == "event" else first.faults
        told.append(
            {
                "kind": one.ordered.kind,
                "name": one_line(one.ordered.name),
                "ordered": one_line(one.ordered.trigger),
                "when": one_line(disturbance_times(one, result.tick_rate)),
                "fired": list(one.fired),
                "happened": one.happened,
                "missing": one.missing,
                "effect": one_line(one.effect),
                "line": known.get(number, one.ordered.line) if len(lines) == 1 else one.ordered.line,
            }
        )
    return told


def _verdict(verdict: Verdict, result: RunResult, lines: dict[str, SourceLines]) -> dict[str, Any]:
    robot, _, name = verdict.id.partition("/")
    if robot not in lines or not name:
        robot, name = next(iter(lines)), verdict.id
    return {
        "id": one_line(verdict.id),
        "robot": robot,
        "status": verdict.status.value,
        "severity": verdict.severity,
        "line": lines[robot].criteria.get(name) or _disturbance_line(verdict, name, result),
        "findings": [_finding(verdict, finding) for finding in verdict.findings],
        "tightest": verdict.findings.index(verdict.tightest) if verdict.tightest is not None else None,
    }


def _disturbance_line(verdict: Verdict, name: str, result: RunResult) -> int:
    """The line of the event or fault that did not happen."""
    if verdict.criterion != DISTURBANCE:
        return 0
    ordered = [one.ordered for one in result.disturbances]
    return next((one.line for one in ordered if one.name in (name, name.rpartition("#")[0])), 0)


def _finding(verdict: Verdict, finding: Finding) -> dict[str, Any]:
    return {
        "status": finding.status.value,
        "what": one_line(subject(verdict, finding)),
        "said": one_line(comparison(finding)),
        "margin": None if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip(),
        "tick": finding.tick,
        "place": None if finding.place is None else [round(axis, 3) for axis in finding.place],
        "detail": [one_line(text) for text in finding.detail],
    }
