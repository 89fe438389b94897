"""Data of one run for the replay page: result, timeline, scenery, objects and robots."""

from collections.abc import Iterable, Mapping
from typing import Any

from simscen.core.environment.scenery import Scenery
from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.record.log_header import scenery_from_header
from simscen.record.log_reader.read import Log
from simscen.report.display_text import escape_control, one_line
from simscen.report.replay.packed_columns import PackedColumns
from simscen.report.replay.robot_data import grid_of, moving_objects, robot_data
from simscen.report.replay.timeline import disturbance_data, read_source_lines, timeline_entries, verdict_data

MAX_MASK_BLOCKS = 2000
"""Maximum number of blocks of a filter mask to draw, the largest first."""


def scenery_data(log: Log, columns: PackedColumns) -> dict[str, Any]:
    """Return the objects, places, ramps, floors and zones of a log, and the map of the world."""
    scenery = scenery_from_header(log.header)
    return {
        "things": {
            one_line(thing.name): {
                "pose": [round(part, 4) for part in thing.pose],
                "parts": [points(outline) for outline in thing.outlines],
            }
            for thing in scenery.things
        },
        "places": {one_line(name): [round(pose.x, 3), round(pose.y, 3)] for name, pose in scenery.places.items()},
        "ground": [{"outline": points(one.outline), "height": one.height} for one in scenery.ground],
        "floors": [{"outline": points(one.outline), "friction": one.friction} for one in scenery.floors],
        "zones": _zones(scenery),
        "map": None if scenery.map is None else grid_of(scenery.map.grid, columns),
    }


def _zones(scenery: Scenery) -> list[dict[str, Any]]:
    """Return the zones of costmap filters, with masks as blocks."""
    zones = []
    for zone in scenery.zones:
        data: dict[str, Any] = {"filter": zone.filter, "region": one_line(zone.region), "limit": zone.speed_limit}
        if zone.cells is not None:
            blocks = sorted(zone.cells.blocks, key=lambda block: -block[2] * block[3])[:MAX_MASK_BLOCKS]
            data["mask"] = {
                "origin": [round(part, 4) for part in zone.cells.origin],
                "resolution": zone.cells.resolution,
                "blocks": [list(block) for block in blocks],
            }
        zones.append(data)
    return zones


def points(polygon: Iterable[Iterable[float]]) -> list[list[float]]:
    """Return corners, rounded to millimeters."""
    return [[round(float(axis), 3) for axis in corner] for corner in polygon]


MAX_SCENARIO_CHARACTERS = 400_000
"""Maximum length of the text of a scenario."""


def run_data(log: Log, result: RunResult, columns: PackedColumns) -> dict[str, Any]:
    """Return the data of a run, with the data of each robot in `robots`."""
    parts: Mapping[str, Log] = log.robots or {"": log}
    sources = {name: read_source_lines(log.header.scenario, name) for name in parts}
    lines = {name: source_lines for name, (source_lines, _) in sources.items()}
    first = next(iter(parts))
    robots = frozenset(log.robots)
    events = [
        entry.as_data(name)
        for name, part in parts.items()
        for entry in timeline_entries(part.trace, lines[name], with_world=name == first)
        if entry.name not in robots or not entry.kind.startswith("object.")
    ]
    key = result.key
    return {
        "scenario": one_line(key.scenario),
        "seed": key.seed,
        "variation": one_line(key.variation),
        "stack": one_line(key.stack_name or log.header.facts.get("stack", "")),
        "outcome": result.outcome.value,
        "reason": one_line(result.reason),
        "error": None if result.error is None else one_line(f"{result.error.kind}: {result.error.message}"),
        "ended": one_line(result.ended),
        "complete": log.complete,
        "rate": log.trace.tick_rate,
        "end": log.trace.end,
        "again": escape_control(result.again) if result.path else "",
        "verdicts": verdict_data(result, lines),
        "disturbances": disturbance_data(result, lines),
        "metrics": {name: value for name, value in sorted(result.metrics.items()) if value is not None},
        "events": sorted(events, key=lambda event: event["tick"]),
        "text": escape_control(log.header.scenario[:MAX_SCENARIO_CHARACTERS]).rstrip("\n").split("\n"),
        "regions": {one_line(name): points(polygon) for name, polygon in log.header.case.regions.items()},
        "scenery": scenery_data(log, columns),
        "spawned": [
            _spawned(event) for event in log.trace.of_kind(EventKind.OBJECT_SPAWNED) if event.name not in robots
        ],
        "gone": [[one_line(event.name), event.tick] for event in log.trace.of_kind(EventKind.OBJECT_REMOVED)],
        "things": moving_objects(log.trace, columns, robots),
        "robots": [
            robot_data(name, part, lines[name], sources[name][1], result.verdicts, columns)
            for name, part in parts.items()
        ],
    }


def _spawned(event: Event) -> dict[str, Any]:
    """Return the data of a spawned object: tick, pose, and outlines in its own frame."""
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
