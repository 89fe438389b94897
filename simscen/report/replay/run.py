"""One run as the page gets it: names and words as JSON, numbers as columns."""

from collections.abc import Mapping
from typing import Any

from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.record.replay import Log
from simscen.report.replay.columns import Columns
from simscen.report.replay.happened import happened
from simscen.report.replay.lines import lines_of
from simscen.report.replay.robot import robot_of, things_of
from simscen.report.replay.scenery import points, scenery_data
from simscen.report.replay.verdicts import disturbances_of, verdicts_of
from simscen.report.text import one_line, visible

MOST_TEXT = 400_000
"""Characters of a scenario's text."""


def run_data(log: Log, result: RunResult, columns: Columns) -> dict[str, Any]:
    """All of a run; of several robots, each in `robots`."""
    parts: Mapping[str, Log] = log.robots or {"": log}
    known = {name: lines_of(log.about.scenario, name) for name in parts}
    lines = {name: found for name, (found, _) in known.items()}
    first = next(iter(parts))
    robots = frozenset(log.robots)
    events = [
        told.as_data(name)
        for name, part in parts.items()
        for told in happened(part.trace, lines[name], shared=name == first)
        if told.name not in robots or not told.kind.startswith("object.")
    ]
    key = result.key
    return {
        "scenario": one_line(key.scenario),
        "seed": key.seed,
        "variation": one_line(key.variation),
        "stack": one_line(key.stack_name or log.about.facts.get("stack", "")),
        "outcome": result.outcome.value,
        "reason": one_line(result.reason),
        "error": None if result.error is None else one_line(f"{result.error.kind}: {result.error.message}"),
        "ended": one_line(result.ended),
        "complete": log.complete,
        "rate": log.trace.tick_rate,
        "end": log.trace.end,
        "again": visible(result.again) if result.path else "",
        "verdicts": verdicts_of(result, lines),
        "disturbances": disturbances_of(result, lines),
        "metrics": {name: value for name, value in sorted(result.metrics.items()) if value is not None},
        "events": sorted(events, key=lambda event: event["tick"]),
        "text": visible(log.about.scenario[:MOST_TEXT]).rstrip("\n").split("\n"),
        "regions": {one_line(name): points(polygon) for name, polygon in log.about.case.regions.items()},
        "scenery": scenery_data(log, columns),
        "spawned": [
            _spawned(event) for event in log.trace.of_kind(EventKind.OBJECT_SPAWNED) if event.name not in robots
        ],
        "gone": [[one_line(event.name), event.tick] for event in log.trace.of_kind(EventKind.OBJECT_REMOVED)],
        "things": things_of(log.trace, columns, robots),
        "robots": [
            robot_of(name, part, lines[name], known[name][1], result.verdicts, columns) for name, part in parts.items()
        ],
    }


def _spawned(event: Event) -> dict[str, Any]:
    """A thing that was put into the world: when, where, and what it looks like from above, in its own frame."""
    parts: Any = event.data.get("parts")
    outlines = parts if isinstance(parts, list) and parts else []
    return {
        "name": one_line(event.name),
        "tick": event.tick,
        "pose": [_number(event.data.get(key)) for key in ("x", "y", "yaw")],
        "parts": [points(outline) for outline in outlines],
        "person": bool(event.data.get("person")),
    }


def _number(value: object) -> float:
    return round(float(value), 4) if isinstance(value, int | float) else 0.0
