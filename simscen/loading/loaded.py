"""Results of loading: validated specifications and the files they came from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.core.records.run_result import RunKey, scenario_title
from simscen.core.records.verdict import ExpectedFailure
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.yaml.tree import Key, MappingNode, Position, key_position, value_position
from simscen.model.robot import RobotSpec
from simscen.model.ros_map import RosMapSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import WorldSpec


@dataclass(frozen=True)
class LoadedMap:
    """ROS map: `path` of its YAML file, `image` file, and `notes` (warnings about keys without a meaning)."""

    path: Path
    spec: RosMapSpec
    image: Path
    notes: tuple[Problem, ...] = ()


class JudgedMask(NamedTuple):
    """Filter mask of a criterion: keys where it is named first, and the map."""

    keys: tuple[Key, ...]
    map: LoadedMap


@dataclass(frozen=True)
class LoadedWorld:
    """World: a world file (`spec`, perhaps with a `map` or an `sdf`), a ROS map, or an SDF file.

    `path` is its file; for an inline world, the file of the scenario.
    """

    name: str
    path: Path
    spec: WorldSpec | None = None
    map: LoadedMap | None = None
    sdf: Path | None = None
    tree: MappingNode | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class LoadedRobot:
    """Robot: `spec` of its `*.robot.yaml`, and `urdf` if it has one. A robot from a bare `.urdf` has no `spec`.

    `path` is the file that the scenario names; `bundled` robots ship with simscen; `packages` are the folders of ROS
    packages that its file names.
    """

    name: str
    path: Path
    spec: RobotSpec | None = None
    urdf: Path | None = None
    bundled: bool = False
    tree: MappingNode | None = field(repr=False, default=None)
    packages: Mapping[str, Path] = field(default_factory=dict)


@dataclass(frozen=True)
class LoadedScenario:
    """Valid scenario, checked as far as possible without building its world.

    `id` is its path relative to the root, without suffix; `file` is absolute, and `path` relative to the root, as in
    problems. `text` is the file as read; `sources` are the texts of all files, by the names that problems use, and
    `files` their absolute paths. `read` are further files that world and robot were built from. `notes` are warnings.

    `map` is the map of the robot: a ROS map, "none" for driving without a map, or None for the map of the world.
    `keepout_mask` and `speed_mask` are those of the stack, `judged_masks` those of criteria, by file as written.
    With `lenient`, unusable parts of an SDF world are skipped with a note.

    `choice` is the stack selected on the command line; it is part of the run keys if the session has `several_stacks`.
    `runs` is the command of an external stack, if defined. `variation` is the name of the variation ("" without
    variations), `varied` has its values by path, and `set_by` the path that set a value, by the position of the value.

    `robots` are the views of a scenario of several robots: each is a scenario of that robot alone, with its name as
    `robot_name` and the others as `other_robots`. The scenario itself then describes the first robot.
    """

    id: str
    path: str
    file: Path
    root: Path
    world_path: tuple[Path, ...]
    text: str
    spec: ScenarioSpec
    world: LoadedWorld
    map: LoadedMap | Literal["none"] | None
    robot: LoadedRobot
    tree: MappingNode = field(repr=False)
    sources: Mapping[str, str] = field(repr=False, default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)
    read: tuple[Path, ...] = ()
    notes: tuple[Problem, ...] = ()
    lenient: bool = False
    keepout_mask: LoadedMap | None = None
    speed_mask: LoadedMap | None = None
    judged_masks: Mapping[str, JudgedMask] = field(default_factory=dict)
    choice: StackChoice | None = None
    several_stacks: bool = False
    runs: ExternalCommand | None = None
    variation: str = ""
    varied: Mapping[str, Any] = field(default_factory=dict, repr=False)
    set_by: Mapping[Position, str] = field(default_factory=dict, repr=False)
    robots: Mapping[str, "LoadedScenario"] = field(default_factory=dict)
    robot_name: str = ""
    other_robots: tuple[str, ...] = ()

    @property
    def each(self) -> Mapping[str, "LoadedScenario"]:
        """The views of all robots by name; a single robot has no name."""
        return self.robots or {self.robot_name: self}

    def having(self, **changes: Any) -> "LoadedScenario":
        """Return the scenario, and the views of its robots, with other values of fields."""
        robots = {name: view.having(**changes) for name, view in self.robots.items()}
        return replace(self, **changes, robots=robots)

    def concerns(self, robot: str | None) -> bool:
        """Return whether something about a robot (None: about the only robot or the world) applies to this robot."""
        return robot is None or not self.robot_name or robot == self.robot_name

    @property
    def title(self) -> str:
        """The id with the name of the variation."""
        return scenario_title(self.id, self.variation)

    @property
    def stack_name(self) -> str:
        """Name of the stack in run keys, if the session has several stacks."""
        return self.choice.name if self.choice is not None and self.several_stacks else ""

    @property
    def stack(self) -> str:
        """NAME=VALUE of the selected stack, with the file relative to the root; "" for its own stack."""
        return "" if self.choice is None else self.choice.seen_from(self.root)

    @property
    def expectation(self) -> ExpectedFailure | None:
        """Its expected failure, with the line if that is in its own file."""
        said = self.spec.expected
        if said is None:
            return None
        place = self.key_place_of("expected")
        return ExpectedFailure(said.fail, tuple(said.criteria), place.line if place.path == self.path else 0)

    def key(self, seed: int) -> RunKey:
        """Return the key of its run with this seed."""
        return RunKey(self.id, seed, self.variation, self.stack_name)

    def place_of(self, *keys: Key) -> Position:
        """Return the position of the value at `keys`, e.g. `place_of("goals", 0, "pose")`."""
        return value_position(self.tree, keys)

    def key_place_of(self, *keys: Key) -> Position:
        """Return the position of the last of `keys`."""
        return key_position(self.tree, keys)

    def problem(self, keys: tuple[Key, ...], code: str, message: str, hint: str = "") -> Problem:
        """Return a problem at the value of `keys`, with the text of its line."""
        return self.problem_at(self.place_of(*keys), code, message, hint)

    def problem_at(self, place: Position, code: str, message: str, hint: str = "") -> Problem:
        """Return a problem at a position in any of the files, with the text of its line."""
        return self.sourced(Problem(*place, code=code, message=message, hint=hint))

    def sourced(self, problem: Problem) -> Problem:
        """Return a problem in any of the files with the text of its line."""
        lines = self.sources.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem
