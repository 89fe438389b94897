"""Reads the world, robot, and stack of a run from the header of a simscen log.

The events, faults, criteria, and objects of the recorded scenario are not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Array
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode
from simscen.reconstruction.drive.recorded_drive import Polygon
from simscen.record.foreign.raw_messages import is_simscen_log, recorded_robots
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log, invalid_log, read_log
from simscen.sim.body.outline import circle


class RecordedRobot(NamedTuple):
    """Another robot in the log, which is not reconstructed.

    Attributes:
        name: Name of the robot.
        outline: Corners of the footprint in m, in the frame of the robot.
        times: Times (n,) in s since the start of the log.
        poses: True poses x, y, yaw (n, 3) in the map frame.
    """

    name: str
    outline: Polygon
    times: Array
    poses: Array


@dataclass(frozen=True)
class RunDescription:
    """Description of the recorded run. The defaults are for logs of real robots.

    Attributes:
        seed: Seed of the run.
        world: World file, or the data of an inline world without objects; None if unknown.
        has_map: Whether the robot had a map.
        robot: Name of a shipped robot, or robot file; None if unknown.
        stack: Key `stack` of the recorded scenario.
        other_robots: Robots that are not reconstructed.
        notes: Notes for the user about missing files.
    """

    seed: int = 1
    world: Path | Mapping[str, Any] | None = None
    has_map: bool = True
    robot: str | Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    other_robots: tuple[RecordedRobot, ...] = ()
    notes: tuple[str, ...] = ()


def checked_robot_name(log: Path, name: str) -> str:
    """Return `name` for a simscen log with several robots, and "" for all other logs.

    Raises InvalidInput if the log has several robots, but no robot with this name.
    """
    robots = () if log.is_dir() else recorded_robots(log)
    if robots and name not in robots:
        hint = f"choose one: --robot {robots[0]}"
        problem = f"the log has no robot `{name}`" if name else "the log has several robots"
        raise invalid_log(log, "SC804", f"{problem}; its robots are: {', '.join(robots)}", hint)
    return name if robots else ""


def read_description(log: Path, root: Path, robot: str = "") -> RunDescription:
    """Return the description from the header of a log, or the default description for the log of a real robot.

    `root` is the folder of the files that the recorded scenario refers to. In a log with several robots, `robot` is the
    name of the robot to describe. Raises InvalidInput if the recorded scenario is not a YAML mapping.
    """
    if log.is_dir() or not is_simscen_log(log):
        return RunDescription()
    recorded = read_log(log, partial=True)
    tree, problems = parse_yaml(recorded.header.scenario, "scenario.yaml")
    if not isinstance(tree, MappingNode):
        raise InvalidInput(problems)
    if not robot:
        return _describe_run(recorded.header, tree.plain, root)
    robot_data = tree.plain.get("robots", {}).get(robot, {})
    stack = robot_data.get("stack", tree.plain.get("stack", {}))
    scenario_data = {**tree.plain, "robot": robot_data, "stack": stack}
    description = _describe_run(recorded.header.robots[robot], scenario_data, root)
    return replace(description, other_robots=tuple(_other_robots(recorded, robot)))


def _other_robots(recorded: Log, robot: str) -> Iterator[RecordedRobot]:
    """Yield all robots except `robot`."""
    for name, log in recorded.robots.items():
        if name != robot:
            truth, case = log.trace.truth, log.header.case
            outline = case.footprint or tuple(circle(case.inscribed_radius))
            yield RecordedRobot(name, outline, truth.ticks / log.trace.tick_rate, truth.values[:, :3])


def _describe_run(header: LogHeader, scenario_data: Mapping[str, Any], root: Path) -> RunDescription:
    """Return the description of a run from the log header and `scenario_data`, the content of the recorded scenario."""
    scenario_folder = root / Path(header.name).parent
    notes: list[str] = []
    world, robot_model = scenario_data.get("world"), scenario_data.get("robot", {}).get("model", "turtlebot")
    if isinstance(world, str):
        file = (scenario_folder / world).resolve()
        if not file.is_file():
            notes.append(f"the world `{world}` of the run is not below {root}; use --root or --world")
        world = file if file.is_file() else None
    elif isinstance(world, Mapping):
        world = {key: value for key, value in world.items() if key != "objects"}
    robot: str | Path | None = robot_model
    if robot_model.endswith((".yaml", ".yml", ".urdf", ".xacro")):
        file = (scenario_folder / robot_model).resolve()
        if not file.is_file():
            notes.append(f"the robot `{robot_model}` of the run is not below {root}; use --root or --robot")
        robot = file if file.is_file() else None
    has_map, stack = header.map is not None, scenario_data.get("stack", {})
    return RunDescription(header.seed, world, has_map, robot, stack, notes=tuple(notes))
