"""What the header of a log of simscen says about the run: names of its world, map, robot, and stack.

Events, faults, criteria, and objects of the recorded scenario are not read; the reconstruction finds them in the
messages, as in the log of a real robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode
from simscen.reconstruction.drive.recorded_drive import Polygon
from simscen.record.foreign.raw_messages import is_simscen_log
from simscen.record.log_reader.read import invalid_log, read_log

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
        root: Folder that the files lie in.
    """

    seed: int = 1
    world: Path | Mapping[str, Any] | None = None
    has_map: bool = True
    robot: str | Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    footprint: Polygon = ()
    inscribed_radius: float = 0.0
    root: Path | None = None
    notes: tuple[str, ...] = ()


def read_description(log: Path, root: Path) -> RunDescription:
    """Return the description in the header of a log. Files that it names are looked up from `root`.

    Raises InvalidInput for a log with several robots.
    """
    if log.is_dir() or not is_simscen_log(log):
        return RunDescription()
    header = read_log(log, partial=True).header
    if header.robots:
        names = ", ".join(header.robots)
        hint = "reconstruct a run with one robot"
        raise invalid_log(log, "SC804", f"the log has several robots: {names}", hint)
    written = _scenario(header.scenario)
    home = root / Path(header.name).parent
    notes: list[str] = []
    world, robot = written.get("world"), written.get("robot", {}).get("model", "turtlebot")
    if isinstance(world, str):
        file = (home / world).resolve()
        if not file.is_file():
            notes.append(f"the world `{world}` of the run is not below {root}; use --root or --world")
        world = file if file.is_file() else None
    elif isinstance(world, Mapping):
        world = {key: value for key, value in world.items() if key not in OBJECT_KEYS}
    model: str | Path = robot
    if robot.endswith((".yaml", ".yml", ".urdf", ".xacro")):
        model = file = (home / robot).resolve()
        if not file.is_file():
            notes.append(f"the robot `{robot}` of the run is not below {root}; use --root or --robot")
            return _described(header, world, None, written, notes)
    return _described(header, world, model, written, notes)


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
