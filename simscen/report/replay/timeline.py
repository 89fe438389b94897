"""Timeline, verdicts, and disturbances of a run for the replay page, with line numbers in the scenario file.

A disturbance is an event or a fault of the scenario.
"""

from collections.abc import Iterator
from math import isfinite
from typing import Any, TypeGuard

from simscen.core.messages.goals import goal_without_loop
from simscen.core.records.events import GOAL_END_KINDS, Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Verdict
from simscen.judge.finding_text import DISTURBANCE, comparison, disturbance_times, subject
from simscen.judge.several_robots import WORLD_EVENT_PREFIXES
from simscen.report.display_text import one_line
from simscen.report.replay.source_lines import SourceLines

K = EventKind
"""Abbreviation for the tables below."""
_LANES = {
    K.GOAL_ACCEPTED: "goals", K.GOAL_REACHED: "goals", K.GOAL_PASSED: "goals", K.GOAL_FAILED: "failures",
    K.GOAL_CANCELED: "goals", K.NAVIGATION_ENDED: "goals", K.PLAN_MADE: "plans", K.PLAN_FAILED: "plans",
    K.RECOVERY_STARTED: "recoveries", K.RECOVERY_ENDED: "recoveries", K.COLLISION_STARTED: "failures",
    K.COLLISION_ENDED: "failures", K.FAULT_STARTED: "faults", K.FAULT_TOOK_EFFECT: "faults", K.FAULT_ENDED: "faults",
    K.ROBOT_HELD: "recoveries", K.ROBOT_RELEASED: "recoveries",
}  # fmt: skip
"""Lane (row) of the timeline by kind of event. Other kinds are in the lane "events"."""
_INTERVAL_KINDS = {
    K.GOAL_ACCEPTED: GOAL_END_KINDS,
    K.RECOVERY_STARTED: (K.RECOVERY_ENDED,),
    K.ROBOT_HELD: (K.ROBOT_RELEASED,),
    K.COLLISION_STARTED: (K.COLLISION_ENDED,),
    K.FAULT_STARTED: (K.FAULT_ENDED,),
    K.EVENT_STARTED: (K.EVENT_ENDED,),
}
"""Kinds of events that end an interval, by the kind of event that starts it."""
_FAILURE_KINDS = {K.GOAL_FAILED, K.COLLISION_STARTED, K.PLAN_FAILED}
"""Kinds of events that are failures."""
_HIDDEN_KEYS = {"tick", "entry", "parts", "points", "waypoints", "times", "index", "effects"}
"""Keys of event data that are not shown as text."""
_OPTIONAL_KEYS = {"until", "ended", "bad", "line", "place", "about", "robot"}
"""Keys of an entry of the timeline that are omitted for empty values."""


def timeline_data(trace: Trace, lines: SourceLines, robot: str, with_world: bool) -> list[dict[str, Any]]:
    """Return the JSON data of the events of a robot in order; with `with_world`, also of the events of the world.

    `robot` is "" in a run with a single robot. In the data, `lane` is the row of an entry. An interval ends at the tick
    `until`, with an event of the kind `ended` or with the run. `about` is the data of an event that switches a zone on
    or off.
    """
    entries: list[dict[str, Any]] = []
    open_intervals: dict[tuple[EventKind, str, Any], dict[str, Any]] = {}
    for event in trace.events:
        is_world_event = str(event.kind).startswith(WORLD_EVENT_PREFIXES) and event.kind != EventKind.RUN_ENDED
        if is_world_event and not with_world:
            continue
        entry = event.data.get("entry")  # two faults or events can have the same name
        for start, ends in _INTERVAL_KINDS.items():
            interval = open_intervals.pop((start, event.name, entry), None) if event.kind in ends else None
            if interval is not None:
                interval |= {"until": event.tick, "ended": str(event.kind)}
        entries.append(_entry(event, lines, robot))
        if event.kind in _INTERVAL_KINDS:
            open_intervals[event.kind, event.name, entry] = entries[-1]
    for interval in open_intervals.values():
        interval["until"] = trace.end
    return [{key: value for key, value in data.items() if value or key not in _OPTIONAL_KEYS} for data in entries]


def _entry(event: Event, lines: SourceLines, robot: str) -> dict[str, Any]:
    x, y = event.data.get("x"), event.data.get("y")
    return {
        "tick": event.tick,
        "kind": str(event.kind),
        "lane": _LANES.get(event.kind, "events"),
        "name": one_line(event.name),
        "text": one_line(", ".join(_details(event))),
        "until": None,
        "ended": "",
        "bad": event.kind in _FAILURE_KINDS,
        "line": _line(event, lines),
        "place": (round(x, 3), round(y, 3)) if is_finite_number(x) and is_finite_number(y) else (),
        "about": event.data if event.kind == K.ZONE_SWITCHED else {},
        "robot": robot,
    }


def _details(event: Event) -> Iterator[str]:
    """Yield the effects and the other data of an event as texts."""
    effects = event.data.get("effects")
    if isinstance(effects, list):
        yield from (str(one["what"]) for one in effects if isinstance(one, dict) and one.get("what"))
    for key, value in event.data.items():
        if key not in _HIDDEN_KEYS and value not in ("", None) and not isinstance(value, list | dict):
            text = f"{value:.4g}" if isinstance(value, float) else str(value)
            yield f"{key.replace('_', ' ')} {text}"


def is_finite_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number that JSON can represent."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _line(event: Event, lines: SourceLines) -> int:
    """Return the line of the scenario's event, fault, or goal to which a recorded event belongs; 0 if unknown."""
    entry = event.data.get("entry")
    if isinstance(entry, int):
        return (lines.faults if str(event.kind).startswith("fault.") else lines.events).get(entry, 0)
    if str(event.kind).startswith("goal."):
        return lines.goals.get(goal_without_loop(event.name), 0)
    return 0


def disturbance_data(result: RunResult, lines: dict[str, SourceLines]) -> list[dict[str, Any]]:
    """Return the JSON data of the events and faults of the scenario. `lines` are the line numbers by robot."""
    data, numbers = [], {"event": 0, "fault": 0}
    first = next(iter(lines.values()))
    for outcome in result.disturbances:
        disturbance = outcome.disturbance
        number = numbers[disturbance.kind]
        numbers[disturbance.kind] += 1
        line_numbers = first.events if disturbance.kind == "event" else first.faults
        data.append(
            {
                "kind": disturbance.kind,
                "name": one_line(disturbance.name),
                "ordered": one_line(disturbance.trigger),
                "when": one_line(disturbance_times(outcome, result.tick_rate)),
                "fired": list(outcome.fired),
                "happened": outcome.happened,
                "missing": outcome.missing,
                "effect": one_line(outcome.effect),
                "line": line_numbers.get(number, disturbance.line) if len(lines) == 1 else disturbance.line,
            }
        )
    return data


def verdict_data(verdict: Verdict, result: RunResult, lines: dict[str, SourceLines]) -> dict[str, Any]:
    """Return the JSON data of a verdict. `lines` are the line numbers by robot."""
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
    """Return the line of the disturbance that did not take place according to a verdict; 0 for other verdicts."""
    if verdict.criterion != DISTURBANCE:
        return 0
    disturbances = [outcome.disturbance for outcome in result.disturbances]
    return next((each.line for each in disturbances if each.name in (name, name.rpartition("#")[0])), 0)


def _finding(verdict: Verdict, finding: Finding) -> dict[str, Any]:
    place = finding.place
    return {
        "status": finding.status.value,
        "what": one_line(subject(verdict, finding)),
        "said": one_line(comparison(finding)),
        "margin": None if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip(),
        "tick": finding.tick,
        "place": [round(axis, 3) for axis in place] if place is not None and all(map(isfinite, place)) else None,
        "detail": [one_line(text) for text in finding.detail],
    }
