"""What the header of a log of simscen says about the run: names of its world, map, robot, and stack.

Events, faults, criteria, and objects of the recorded scenario are not read; the reconstruction finds them in the
messages, as in the log of a real robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Array
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode
from simscen.reconstruction.drive.recorded_drive import Polygon
from simscen.record.foreign.raw_messages import is_simscen_log, recorded_robots
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log, invalid_log, read_log
from simscen.sim.body.outline import circle

OBJECT_KEYS = ("objects",)
"""Keys of an inline world whose contents the reconstruction has to find in the scans."""


@dataclass(frozen=True)
class RunDescription:
    """Description of the run, empty for logs of real robots.

    Attributes:
        seed: Seed of the run.
        world: World file, or an inline world without its objects; None if unknown.
        has_map: False if the robot drove without a map.
        robot: Shipped robot or robot file; None if unknown.
        stack: Configuration of the stack.
        others: The other robots of a log with several: names, footprints, times (n,) in s, and true poses (n, 3).
        root: Folder that the files lie in.
    """

    seed: int = 1
    world: Path | Mapping[str, Any] | None = None
    has_map: bool = True
    robot: str | Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    footprint: Polygon = ()
    inscribed_radius: float = 0.0
    others: tuple[tuple[str, Polygon, Array, Array], ...] = ()
    root: Path | None = None
    notes: tuple[str, ...] = ()


def choose_robot(log: Path, name: str) -> str:
    """Return the robot to reconstruct of a log with several robots, by its name; "" for a log with one robot.

    Raises InvalidInput if the log has several robots, and none has this name.
    """
    robots = () if log.is_dir() else recorded_robots(log)
    if robots and name not in robots:
        hint = f"choose one: --robot {robots[0]}"
        raise invalid_log(log, "SC804", f"the log has several robots: {', '.join(robots)}", hint)
    return name if robots else ""


def read_description(log: Path, root: Path, robot: str = "") -> RunDescription:
    """Return the description in the header of a log. Files that it names are looked up from `root`.

    Of a log with several robots, `robot` is the one that is described.
    """
    if log.is_dir() or not is_simscen_log(log):
        return RunDescription()
    recorded = read_log(log, partial=True)
    header, written = recorded.header, _scenario(recorded.header.scenario)
    if robot:
        header, written = header.robots[robot], _of_robot(written, robot)
        described = _described_run(header, written, root)
        return replace(described, others=tuple(_others(recorded, robot)))
    return _described_run(header, written, root)


def _others(recorded: Log, robot: str) -> Iterator[tuple[str, Polygon, Array, Array]]:
    for name, log in recorded.robots.items():
        if name != robot:
            truth, case = log.trace.truth, log.header.case
            outline = case.footprint or tuple(circle(case.inscribed_radius))
            yield name, outline, truth.ticks / log.trace.tick_rate, truth.values[:, :3]


def _described_run(header: LogHeader, written: Mapping[str, Any], root: Path) -> RunDescription:
    scenario_folder = root / Path(header.name).parent
    notes: list[str] = []
    world, named = written.get("world"), written.get("robot", {}).get("model", "turtlebot")
    if isinstance(world, str):
        file = (scenario_folder / world).resolve()
        if not file.is_file():
            notes.append(f"the world `{world}` of the run is not below {root}; use --root or --world")
        world = file if file.is_file() else None
    elif isinstance(world, Mapping):
        world = {key: value for key, value in world.items() if key not in OBJECT_KEYS}
    model: str | Path = named
    if named.endswith((".yaml", ".yml", ".urdf", ".xacro")):
        model = file = (scenario_folder / named).resolve()
        if not file.is_file():
            notes.append(f"the robot `{named}` of the run is not below {root}; use --root or --robot")
            return _described(header, world, None, written, notes)
    return _described(header, world, model, written, notes)


def _of_robot(written: Mapping[str, Any], robot: str) -> Mapping[str, Any]:
    """Return the data of a scenario with several robots as that of a scenario with this robot alone."""
    own = written.get("robots", {}).get(robot, {})
    return {**written, "robot": own, "stack": own.get("stack", written.get("stack", {}))}


def _described(
    header: Any, world: Any, robot: str | Path | None, written: Mapping[str, Any], notes: list[str]
) -> RunDescription:
    return RunDescription(
        seed=header.seed,
        world=world,
        has_map=header.map is not None,
        robot=robot,
        stack=written.get("stack", {}),
        footprint=header.case.footprint,
        inscribed_radius=header.case.inscribed_radius,
        notes=tuple(notes),
    )


def _scenario(text: str) -> Mapping[str, Any]:
    """Return the data of the recorded scenario."""
    tree, problems = parse_yaml(text, "scenario.yaml")
    if not isinstance(tree, MappingNode):
        raise InvalidInput(problems)
    return tree.plain
