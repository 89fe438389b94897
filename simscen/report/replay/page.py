"""Replay page, replay.html: a single file that plays one run, or two runs side by side.

The JavaScript modules are joined to one script, because a page without a server cannot load modules.
"""

import base64
import json
import re
import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any

from simscen.core.environment.scenery import Scenery
from simscen.core.records.event_shapes import spawn_pose, spawned_outlines
from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.core.version import PACKAGE
from simscen.record.log_header import scenery_from_header
from simscen.record.log_reader import Log
from simscen.report.display_text import csp_hash, escape_control, one_line
from simscen.report.picture.palette import css_variables
from simscen.report.replay.packed_columns import PackedColumns
from simscen.report.replay.robot_data import moving_objects, occupancy_grid_data, robot_data
from simscen.report.replay.source_lines import read_source_lines
from simscen.report.replay.timeline import disturbance_data, is_finite_number, timeline_data, verdict_data

PAGE_FOLDER = PACKAGE / "data" / "replay"
FORMAT = 1
"""Version of the data on the page."""
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([a-z]+)\.js";\n', re.MULTILINE)
_COMPRESSION_LEVEL = 6


def replay_page(runs: Sequence[tuple[Log, RunResult]]) -> bytes:
    """Return the page of one run, or of two runs to compare. Equal logs and results give equal bytes."""
    columns = PackedColumns()
    data_of_runs = [run_data(log, result, columns) for log, result in runs]
    document = {"format": FORMAT, "runs": data_of_runs, "leftOut": list(dict.fromkeys(columns.reductions))}
    data = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    title = " against ".join(_title(run) for run in data_of_runs)
    return page_html(title, data.encode(), columns.data).encode()


def write_replay(path: Path, runs: Sequence[tuple[Log, RunResult]]) -> None:
    """Write the page to a file."""
    path.write_bytes(replay_page(runs))


def page_html(title: str, data: bytes, numbers: bytes) -> str:
    """Return the HTML with a content security policy that allows only the script and style of the page.

    `data` is a JSON document, `numbers` are the encoded arrays of PackedColumns.
    """
    compressed = zlib.compress(struct.pack("<I", len(data)) + data + numbers, _COMPRESSION_LEVEL)
    packed = compressed[2:-4]  # deflate without header
    parts = {name: (PAGE_FOLDER / f"page.{name}").read_text(encoding="utf-8") for name in ("html", "css")}
    parts = {**parts, "css": css_variables() + parts["css"], "js": joined_script()}
    policy = (
        f"default-src 'none'; script-src '{csp_hash(parts['js'])}'; style-src '{csp_hash(parts['css'])}'; "
        "img-src data:; base-uri 'none'; form-action 'none'; require-trusted-types-for 'script'"
    )
    values = {"policy": policy, "title": escape(title), "style": parts["css"], "script": parts["js"]}
    values["data"] = base64.b64encode(packed).decode("ascii")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: values[match[1]], parts["html"])


@lru_cache(maxsize=1)
def joined_script() -> str:
    """Return all JavaScript modules as one script."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(PAGE_FOLDER.glob("*.js"))}
    modules = [
        re.sub(r"^export ", "", _IMPORT.sub("", texts[name]), flags=re.MULTILINE) for name in _sorted_modules(texts)
    ]
    return "\n".join(modules)


def _sorted_modules(texts: Mapping[str, str]) -> list[str]:
    """Return the names of the modules. Imported modules precede the importing one. `texts` are the sources by name."""
    ordered: list[str] = []

    def visit(name: str) -> None:
        if name not in ordered:
            for imported in _IMPORT.findall(texts[name]):
                visit(imported)
            ordered.append(name)

    visit("main")
    return ordered


def _title(run: Mapping[str, Any]) -> str:
    parts = [run["scenario"], f"seed {run['seed']}", run["variation"], run["stack"], run["outcome"]]
    return ", ".join(part for part in parts if part)


MAX_MASK_BLOCKS = 2000
"""Maximum number of blocks of a filter mask. If there are more, the page shows the largest blocks."""


def scenery_data(log: Log, columns: PackedColumns) -> dict[str, Any]:
    """Return the objects, places, ramps, floors, zones, and map of the world in a log as JSON data."""
    scenery = scenery_from_header(log.header)
    return {
        "things": {
            one_line(thing.name): {
                "pose": [round(part, 4) for part in thing.pose],
                "parts": [corners_data(outline) for outline in thing.outlines],
            }
            for thing in scenery.things
        },
        "places": {one_line(name): [round(pose.x, 3), round(pose.y, 3)] for name, pose in scenery.places.items()},
        "ground": [{"outline": corners_data(one.outline), "height": one.height} for one in scenery.ground],
        "floors": [{"outline": corners_data(one.outline), "friction": one.friction} for one in scenery.floors],
        "zones": _zones(scenery),
        "map": None if scenery.map is None else occupancy_grid_data(scenery.map.grid, columns),
    }


def _zones(scenery: Scenery) -> list[dict[str, Any]]:
    """Return the zones of costmap filters as JSON data. A filter mask is a list of blocks of equal cells."""
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


def corners_data(polygon: Iterable[Iterable[float]]) -> list[list[float]]:
    """Return the corners (x, y) of a polygon in m, rounded to millimeters."""
    return [[round(float(axis), 3) for axis in corner] for corner in polygon]


MAX_SCENARIO_CHARACTERS = 400_000
"""Maximum length of the text of the scenario on the page."""


def run_data(log: Log, result: RunResult, columns: PackedColumns) -> dict[str, Any]:
    """Return the JSON data of a run. Long arrays are added to `columns`; the data contains references to them."""
    parts: Mapping[str, Log] = log.robots or {"": log}
    sources = {name: read_source_lines(log.header.scenario, name) for name in parts}
    lines = {name: source_lines for name, (source_lines, _) in sources.items()}
    first = next(iter(parts))
    robots = frozenset(log.robots)
    events = [
        entry
        for name, part in parts.items()
        for entry in timeline_data(part.trace, lines[name], name, with_world=name == first)
        if entry["name"] not in robots or not entry["kind"].startswith("object.")
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
        "verdicts": [verdict_data(verdict, result, lines) for verdict in result.verdicts],
        "disturbances": disturbance_data(result, lines),
        "metrics": {name: value for name, value in sorted(result.metrics.items()) if is_finite_number(value)},
        "events": sorted(events, key=lambda event: event["tick"]),
        "text": escape_control(log.header.scenario[:MAX_SCENARIO_CHARACTERS]).rstrip("\n").split("\n"),
        "regions": {one_line(name): corners_data(polygon) for name, polygon in log.header.case.regions.items()},
        "scenery": scenery_data(log, columns),
        "spawned": [
            _spawned_object_data(event)
            for event in log.trace.of_kind(EventKind.OBJECT_SPAWNED)
            if event.name not in robots
        ],
        "gone": [[one_line(event.name), event.tick] for event in log.trace.of_kind(EventKind.OBJECT_REMOVED)],
        "things": moving_objects(log.trace, columns, robots),
        "robots": [
            robot_data(name, part, lines[name], sources[name][1], result.verdicts, columns)
            for name, part in parts.items()
        ],
    }


def _spawned_object_data(event: Event) -> dict[str, Any]:
    """Return the JSON data of a spawned object: tick, pose, and outlines in the frame of the object."""
    return {
        "name": one_line(event.name),
        "tick": event.tick,
        "pose": [round(part, 4) for part in spawn_pose(event)],
        "parts": [corners_data(outline) for outline in spawned_outlines(event)],
        "person": bool(event.data.get("person")),
    }
