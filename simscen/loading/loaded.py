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
from simscen.loading.yaml.tree import Key, Keys, MappingNode, Position, key_position, value_position
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import RosMapSpec, WorldSpec


@dataclass(frozen=True)
class LoadedMap:
    """ROS map: `path` of its YAML file, `image` file, and `notes` (warnings about keys that have no effect)."""

    path: Path
    spec: RosMapSpec
    image: Path
    notes: tuple[Problem, ...] = ()


class CriterionMask(NamedTuple):
    """Filter mask of a criterion: the map, and the keys of the first criterion that uses it."""

    keys: Keys
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
    """Robot: `spec` of its `*.robot.yaml`, and `urdf` if it has one. A robot that is only a `.urdf` has no `spec`.

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
    problems. `text` is the content of that file; `sources` are the texts of all files, by the names that problems use,
    and `files` their absolute paths. `read_files` are the other files from which world and robot were built. `notes`
    are warnings.

    `map` is the map of the robot: a ROS map, "none" for driving without a map, or None for the map of the world.
    `keepout_mask` and `speed_mask` belong to the stack, `criterion_masks` to criteria (by file name as written).
    With `lenient`, unusable parts of an SDF world are skipped with a note.

    `choice` is the stack selected on the command line; it is part of the run keys if the session has `several_stacks`.
    `external_command` starts its external stack, if defined. `variation` is the name of the variation ("" without
    variations), `varied_values` has its values by path, and `set_by` the path that set a value, by the position of the
    value.

    For several robots, `robots` contains one view per robot: a scenario of that robot alone, with its name as
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
    read_files: tuple[Path, ...] = ()
    notes: tuple[Problem, ...] = ()
    lenient: bool = False
    keepout_mask: LoadedMap | None = None
    speed_mask: LoadedMap | None = None
    criterion_masks: Mapping[str, CriterionMask] = field(default_factory=dict)
    choice: StackChoice | None = None
    several_stacks: bool = False
    external_command: ExternalCommand | None = None
    variation: str = ""
    varied_values: Mapping[str, Any] = field(default_factory=dict, repr=False)
    set_by: Mapping[Position, str] = field(default_factory=dict, repr=False)
    robots: Mapping[str, "LoadedScenario"] = field(default_factory=dict)
    robot_name: str = ""
    other_robots: tuple[str, ...] = ()

    @property
    def robot_views(self) -> Mapping[str, "LoadedScenario"]:
        """The views of all robots by name; a single robot has no name."""
        return self.robots or {self.robot_name: self}

    def with_changes(self, **changes: Any) -> "LoadedScenario":
        """Return the scenario with changed fields, also in the views of its robots."""
        robots = {name: view.with_changes(**changes) for name, view in self.robots.items()}
        return replace(self, **changes, robots=robots)

    def skipped(self, choice: StackChoice, reason: str) -> "LoadedScenario":
        """Return the scenario marked not to be run with the stack `choice`."""
        return replace(self, choice=choice, spec=self.spec.model_copy(update={"skip": reason}))

    def includes_robot(self, robot: str | None) -> bool:
        """Return whether parts of the scenario that name `robot` (None: that name no robot) apply to this view."""
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
        return "" if self.choice is None else self.choice.relative_to_folder(self.root)

    @property
    def expectation(self) -> ExpectedFailure | None:
        """Its expected failure; the line is 0 if `expected` is not in its own file."""
        expected = self.spec.expected
        if expected is None:
            return None
        position = self.key_position_of("expected")
        return ExpectedFailure(
            expected.fail, tuple(expected.criteria), position.line if position.path == self.path else 0
        )

    def key(self, seed: int) -> RunKey:
        """Return the key of the run with this seed."""
        return RunKey(self.id, seed, self.variation, self.stack_name)

    def position_of(self, *keys: Key) -> Position:
        """Return the position of the value at `keys`, e.g. `position_of("goals", 0, "pose")`."""
        return value_position(self.tree, keys)

    def key_position_of(self, *keys: Key) -> Position:
        """Return the position of the last of `keys`."""
        return key_position(self.tree, keys)

    def problem(self, keys: Keys, code: str, message: str, hint: str = "") -> Problem:
        """Return a problem at the value of `keys`, with the text of its line."""
        return self.problem_at(self.position_of(*keys), code, message, hint)

    def problem_at(self, position: Position, code: str, message: str, hint: str = "") -> Problem:
        """Return a problem at a position in any of the files, with the text of its line."""
        return self.with_source_line(Problem(*position, code=code, message=message, hint=hint))

    def with_source_line(self, problem: Problem) -> Problem:
        """Return the problem, which may be in any of the files, with the text of its line."""
        lines = self.sources.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem
