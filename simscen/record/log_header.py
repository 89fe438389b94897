"""What a log says about its run besides what happened: enough to judge it and to run it again."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import Scenery
from simscen.core.geometry import Pose3
from simscen.core.records.case import Case
from simscen.core.records.run_result import RunKey

FORMAT = "1"
STACK_RECORD = "simscen.stack"
"""The metadata record that says what an external stack was: known to its end, so it stands at the end of the log."""
_FACT = "fact."
STACK_FACT, STACK_NAME_FACT, VARIATION_FACT = "stack", "variation", "varied"
"""Facts: NAME=VALUE of the stack that took the place of the scenario's own, what the run is called by it where there
are several, and the scenario's variation."""
ROBOTS, RESOLUTION, ORIGIN = "robots", "map.resolution", "map.origin"
"""In the metadata record: the names of several robots, and where the map of a robot is."""
END, COUNT_PREFIX = "simscen.end", "messages:"
"""Metadata record at the end of a whole log, and what the names of its message counts by topic begin with."""
OWN_FILES = CASE, SCENARIO, RESULT = "case.json", "scenario.yaml", "result.json"
_MEDIA_TYPES = {
    ".json": "application/json",
    ".pgm": "image/x-portable-graymap",
    ".png": "image/png",
    ".txt": "text/plain",
    ".yaml": "application/yaml",
}
_CASES = TypeAdapter(Case)


@dataclass(frozen=True, eq=False)
class LogHeader:
    """A run as it was ordered.

    `name` is the scenario's id, `scenario` its resolved YAML text. `map` is what the robot was given. `frames` are
    where sensors sit on the robot's base; a lidar that is not among them is placed by its first scan. `sensors` are
    the kinds of their readings by name, in the order in which they get their topics; a log that is read does not know.
    `robots` are the headers of each of several robots by name; what stands here of a robot is then that of the first.
    `robot_description` is URDF. `files` travel along under their names, `facts` as metadata; neither may hold a wall
    clock, a host or a process number, or equal runs would differ.
    """

    name: str
    seed: int
    case: Case
    scenario: str = ""
    map: OccupancyGrid | None = None
    robot_description: str = ""
    frames: Mapping[str, Pose3] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    robots: Mapping[str, "LogHeader"] = field(default_factory=dict)

    @property
    def key(self) -> RunKey:
        """The key of the run."""
        return RunKey(self.name, self.seed, self.facts.get(VARIATION_FACT, ""), self.facts.get(STACK_NAME_FACT, ""))


def case_to_json(case: Case) -> str:
    """A Case as strict JSON: infinity, which JSON lacks, is written as the text "Infinity"."""
    return str(to_json(case, inf_nan_mode="strings", indent=1), "utf-8")


def case_from_json(text: str | bytes) -> Case:
    """The Case that `case_to_json` wrote. Raises ValueError when it is none."""
    try:
        return _CASES.validate_json(text)
    except ValidationError as error:
        raise ValueError(f"not a case: {error.errors(include_url=False)[0]['msg']}") from None


def media_type(name: str) -> str:
    """The media type of a file by its name, without asking the machine's own table, which would differ."""
    return _MEDIA_TYPES.get(PurePosixPath(name).suffix, "application/octet-stream")


def run_metadata(about: LogHeader, clock: Clock) -> dict[str, str]:
    """The metadata record "simscen". Numbers are written so that they are read back exactly."""
    known = {"format": FORMAT, "scenario": about.name, "seed": str(about.seed), "tick_rate": str(clock.rate)}
    known |= {ROBOTS: json.dumps(list(about.robots))} if about.robots else _map_facts(about)
    for name, one in about.robots.items():
        known |= {f"{name}.{fact}": value for fact, value in _map_facts(one).items()}
    return known | {f"{_FACT}{name}": value for name, value in about.facts.items()}


def _map_facts(about: LogHeader) -> dict[str, str]:
    if about.map is None:
        return {}
    x, y, yaw = about.map.origin
    return {RESOLUTION: repr(float(about.map.resolution)), ORIGIN: json.dumps([x, y, yaw])}


def robot_metadata(run_metadata: Mapping[str, str], robot: str) -> dict[str, str]:
    """What the metadata record says of one of several robots, as it would of the only one."""
    own = {fact: run_metadata[f"{robot}.{fact}"] for fact in (RESOLUTION, ORIGIN) if f"{robot}.{fact}" in run_metadata}
    return {**run_metadata, **own}


def extra_facts(run_metadata: Mapping[str, str]) -> dict[str, str]:
    """LogHeader.facts as `facts` wrote them."""
    return {name[len(_FACT) :]: value for name, value in run_metadata.items() if name.startswith(_FACT)}


def attachments(about: LogHeader) -> dict[str, bytes]:
    """The files in the log, by name."""
    several = {f"{name}/{CASE}": case_to_json(one.case).encode() for name, one in about.robots.items()}
    own = several or {CASE: case_to_json(about.case).encode()}
    if about.scenario:
        own[SCENARIO] = about.scenario.encode()
    taken = sorted(set(about.files) & set(OWN_FILES))
    if taken:
        raise ValueError(f"a log has a file {taken[0]} of its own")
    return own | dict(about.files)


SCENERY_FILE = "scenery.json"
_SCENERIES = TypeAdapter(Scenery)


def scenery_to_json(scenery: Scenery) -> bytes:
    """The scenery as strict JSON."""
    return to_json(scenery)


def scenery_from_header(about: LogHeader) -> Scenery:
    """What the log says there was to see; nothing where it is older than that. Raises ValueError when it is none."""
    data = about.files.get(SCENERY_FILE)
    if data is None:
        return Scenery()
    try:
        return _SCENERIES.validate_json(data)
    except ValidationError as error:
        raise ValueError(f"not a scenery: {error.errors(include_url=False)[0]['msg']}") from None
