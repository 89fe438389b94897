"""Header of a log: metadata and attachments that are needed to judge or repeat the run."""

import json
import math
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

FORMAT_VERSION = "1"
"""Version of the log format. Logs of another version are rejected."""
RUN_RECORD = "simscen"
"""Name of the metadata record with the description of the run, at the start of a log."""
STACK_RECORD = "simscen.stack"
"""Name of the metadata record with facts about the external stacks, at the end of a log."""
END_RECORD = "simscen.end"
"""Name of the metadata record with the last tick and the message counts, at the end of a complete log."""
COUNT_PREFIX = "messages:"
"""Start of the keys of END_RECORD that count messages. The topic follows."""
_FACT_PREFIX = "fact."
"""Start of the keys of RUN_RECORD that contain `LogHeader.facts`."""
STACK_FACT = "stack"
"""Key of `LogHeader.facts`: value of the option --stack."""
STACK_NAME_FACT = "variation"
"""Key of `LogHeader.facts`: name of the stack if stacks are compared. The key must stay as in older logs."""
VARIATION_FACT = "varied"
"""Key of `LogHeader.facts`: variation of the scenario. The key must stay as in older logs."""
ROBOTS_KEY, RESOLUTION_KEY, ORIGIN_KEY = "robots", "map.resolution", "map.origin"
"""Keys of RUN_RECORD: the names of several robots, and the resolution and origin of a map."""
RESERVED_FILES = CASE_FILE, SCENARIO_FILE, RESULT_FILE = "case.json", "scenario.yaml", "result.json"
"""Names of attachments that are reserved for simscen: the Case, the scenario, and the result of the run."""
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
    """Description of a run at the start of its log.

    `files` and `facts` must not contain wall-clock times, host names, or process IDs, because logs of equal runs must
    be equal.

    Attributes:
        name: ID of the scenario.
        seed: Seed of the run.
        case: Inputs of the criteria besides the trace.
        scenario: Resolved YAML text of the scenario.
        map: Map that the stack receives; None without a map.
        robot_description: URDF of the robot.
        mounts: Poses of the sensors on the robot's base, by sensor name. The pose of any other lidar is in its scans.
        sensors: Class name of the readings ("Scan", …) of each sensor, by sensor name. Empty if read from a log.
        files: Additional attachments by name.
        facts: Additional metadata as text by key.
        robots: Header of each robot by name if there are several robots; empty for a single robot. With several
            robots, the other attributes describe the first one.
    """

    name: str
    seed: int
    case: Case
    scenario: str = ""
    map: OccupancyGrid | None = None
    robot_description: str = ""
    mounts: Mapping[str, Pose3] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    robots: Mapping[str, "LogHeader"] = field(default_factory=dict)

    @property
    def key(self) -> RunKey:
        """Scenario, seed, variation, and stack, which identify the run."""
        return RunKey(self.name, self.seed, self.facts.get(VARIATION_FACT, ""), self.facts.get(STACK_NAME_FACT, ""))


def case_to_json(case: Case) -> str:
    """Return a Case as JSON without `labels` and `objects`. In the JSON, infinity is the string "Infinity"."""
    return str(to_json(case, inf_nan_mode="strings", indent=1, exclude={"labels", "objects"}), "utf-8")


def case_from_json(text: str | bytes) -> Case:
    """Parse the JSON of `case_to_json`. Raises ValueError for other JSON or for poses that are not finite."""
    try:
        case = _CASES.validate_json(text)
    except ValidationError as error:
        raise ValueError(f"not a case: {error.errors(include_url=False)[0]['msg']}") from None
    poses = case.start, *(goal.pose for goal in case.every_goal)
    if not all(math.isfinite(value) for pose in poses for value in pose):
        raise ValueError("not a case: a pose is not finite")
    return case


def media_type(name: str) -> str:
    """Return the media type for a file name. Unlike the module mimetypes, it is the same on all operating systems."""
    return _MEDIA_TYPES.get(PurePosixPath(name).suffix, "application/octet-stream")


def run_metadata(header: LogHeader, clock: Clock) -> dict[str, str]:
    """Return the content of RUN_RECORD, which includes the exact resolution and origin of each map."""
    metadata = {
        "format": FORMAT_VERSION,
        "scenario": header.name,
        "seed": str(header.seed),
        "tick_rate": str(clock.rate),
    }
    metadata |= {ROBOTS_KEY: json.dumps(list(header.robots))} if header.robots else _map_facts(header)
    for name, robot_header in header.robots.items():
        metadata |= {f"{name}.{fact}": value for fact, value in _map_facts(robot_header).items()}
    return metadata | {f"{_FACT_PREFIX}{name}": value for name, value in header.facts.items()}


def _map_facts(header: LogHeader) -> dict[str, str]:
    """Return the exact resolution and origin of the map as metadata; empty without a map."""
    if header.map is None:
        return {}
    x, y, yaw = header.map.origin
    return {RESOLUTION_KEY: repr(float(header.map.resolution)), ORIGIN_KEY: json.dumps([x, y, yaw])}


def robot_metadata(run_metadata: Mapping[str, str], robot: str) -> dict[str, str]:
    """Return the content of RUN_RECORD for one of several robots, with the resolution and origin of the robot's map."""
    map_facts = {
        fact: run_metadata[f"{robot}.{fact}"]
        for fact in (RESOLUTION_KEY, ORIGIN_KEY)
        if f"{robot}.{fact}" in run_metadata
    }
    return {**run_metadata, **map_facts}


def stack_facts(facts: Mapping[str, str], robot: str) -> dict[str, str]:
    """Return the facts about the external stack of one of several robots.

    `facts` are the facts about the stacks of all robots. In `facts`, each key starts with `ROBOT.`.
    """
    prefix = f"{robot}."
    return {name.removeprefix(prefix): fact for name, fact in facts.items() if name.startswith(prefix)}


def extra_facts(run_metadata: Mapping[str, str]) -> dict[str, str]:
    """Return `LogHeader.facts` from the content of RUN_RECORD."""
    return {name[len(_FACT_PREFIX) :]: value for name, value in run_metadata.items() if name.startswith(_FACT_PREFIX)}


def attachments(header: LogHeader) -> dict[str, bytes]:
    """Return all attachments of the log by name. Raises ValueError if one of `header.files` has a reserved name."""
    cases = {f"{name}/{CASE_FILE}": case_to_json(robot.case).encode() for name, robot in header.robots.items()}
    files = cases or {CASE_FILE: case_to_json(header.case).encode()}
    if header.scenario:
        files[SCENARIO_FILE] = header.scenario.encode()
    if reserved := sorted(set(header.files) & set(RESERVED_FILES)):
        raise ValueError(f"the file name {reserved[0]} is reserved in a log")
    return files | dict(header.files)


SCENERY_FILE = "scenery.json"
"""Name of the attachment with the Scenery: objects that pictures and markers show but the trace does not contain."""
_SCENERIES = TypeAdapter(Scenery)


def scenery_to_json(scenery: Scenery) -> bytes:
    """Return the scenery as JSON."""
    return to_json(scenery)


def scenery_from_header(header: LogHeader) -> Scenery:
    """Return the attached scenery, or an empty Scenery if it is missing. Raises ValueError if it is invalid."""
    data = header.files.get(SCENERY_FILE)
    if data is None:
        return Scenery()
    try:
        return _SCENERIES.validate_json(data)
    except ValidationError as error:
        raise ValueError(f"not a scenery: {error.errors(include_url=False)[0]['msg']}") from None
