"""Loaded scenarios, worlds, robots, and maps: validated specifications, and the files from which they were loaded."""

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
    """ROS map: `path` of its YAML file, `image` file, and `notes`, which are warnings about keys without effect."""

    path: Path
    spec: RosMapSpec
    image: Path
    notes: tuple[Problem, ...] = ()


class CriterionMask(NamedTuple):
    """Filter mask of a criterion: the keys where the first criterion that uses it names the mask, and its map."""

    keys: Keys
    map: LoadedMap


@dataclass(frozen=True)
class LoadedWorld:
    """World from a file of simscen (`spec`, which may extend a `map` or an `sdf`), from a ROS map, or from an SDF file.

    `path` is the file of the world; for an inline world, the file of the scenario. `tree` belongs to `spec`.
    """

    name: str
    path: Path
    spec: WorldSpec | None = None
    map: LoadedMap | None = None
    sdf: Path | None = None
    tree: MappingNode | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class LoadedRobot:
    """Robot from the file `path`: a `*.robot.yaml` with a `spec`, which may name a `urdf`; or a URDF without a `spec`.

    `bundled` robots ship with simscen. `tree` belongs to `spec`. `packages` are the folders of the ROS packages that
    the robot file names, by name of the package.
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
    """Valid scenario, or valid variation of a scenario. It has been checked as far as possible without its built world.

    For several robots, `robots` has a view for each robot: a scenario of this robot alone. The other fields of a
    scenario of several robots are those of the view of its first robot, except `spec`, `tree` and `notes`.
    """

    id: str
    """Path relative to the root, without suffix."""
    path: str
    """Path relative to the root, as problems name the file."""
    file: Path
    """Absolute path."""
    root: Path
    world_path: tuple[Path, ...]
    """Folders of `--world-path`, in which worlds are searched."""
    text: str
    """Content of the file."""
    spec: ScenarioSpec
    """Specification, with poses instead of names of places."""
    world: LoadedWorld
    map: LoadedMap | Literal["none"] | None
    """Map that the robot gets: a ROS map, "none" for driving without a map, or None for the map of the world."""
    robot: LoadedRobot
    tree: MappingNode = field(repr=False)
    """Tree of the scenario: all files merged, the variation and the selected stack applied, places still as names."""
    sources: Mapping[str, str] = field(repr=False, default_factory=dict)
    """Texts of all YAML files of the scenario, by their names in problems."""
    files: Mapping[str, Path] = field(default_factory=dict)
    """Absolute paths of these files, by their names in problems."""
    read_files: tuple[Path, ...] = ()
    """Other files that were read to build the world and the robot, such as meshes."""
    notes: tuple[Problem, ...] = ()
    """Warnings."""
    lenient: bool = False
    """Whether unusable parts of an SDF world are skipped with a note, instead of being errors."""
    keepout_mask: LoadedMap | None = None
    """Keepout mask of the stack."""
    speed_mask: LoadedMap | None = None
    """Speed mask of the stack."""
    criterion_masks: Mapping[str, CriterionMask] = field(default_factory=dict)
    """Filter masks of criteria, by path as written."""
    choice: StackChoice | None = None
    """Stack selected on the command line; None for the stack of the scenario."""
    several_stacks: bool = False
    """Whether the session runs the scenario with several stacks, so that the keys of runs contain the stack."""
    external_command: ExternalCommand | None = None
    """Command that starts the external stack of the scenario; None if it has none, or if it is not defined (yet)."""
    variation: str = ""
    """Name of the variation; "" for a file without variations."""
    varied_values: Mapping[str, Any] = field(default_factory=dict, repr=False)
    """Values of the variation, by path."""
    set_by: Mapping[Position, str] = field(default_factory=dict, repr=False)
    """Path that set a varied value, by the position of the value."""
    robots: Mapping[str, "LoadedScenario"] = field(default_factory=dict)
    """Views of the robots by name; empty for a scenario of one robot."""
    robot_name: str = ""
    """In a view, the name of its robot."""
    other_robots: tuple[str, ...] = ()
    """In a view, the names of the other robots."""

    @property
    def robot_views(self) -> Mapping[str, "LoadedScenario"]:
        """The views of all robots by name; for a scenario of one robot, the scenario itself under the name ""."""
        return self.robots or {self.robot_name: self}

    def with_changes(self, **changes: Any) -> "LoadedScenario":
        """Return the scenario with these fields changed, in it and in the views of its robots."""
        robots = {name: view.with_changes(**changes) for name, view in self.robots.items()}
        return replace(self, **changes, robots=robots)

    def skipped(self, choice: StackChoice, reason: str) -> "LoadedScenario":
        """Return the scenario with the stack `choice`, marked as skipped for this reason."""
        return replace(self, choice=choice, spec=self.spec.model_copy(update={"skip": reason}))

    def includes_robot(self, robot: str | None) -> bool:
        """Return whether a part of the scenario that names `robot` applies to this view. None: it names no robot."""
        return robot is None or not self.robot_name or robot == self.robot_name

    @property
    def title(self) -> str:
        """The id with the name of the variation."""
        return scenario_title(self.id, self.variation)

    @property
    def stack_name(self) -> str:
        """Name of the stack in the keys of runs; "" unless the session has several stacks."""
        return self.choice.name if self.choice is not None and self.several_stacks else ""

    @property
    def stack(self) -> str:
        """NAME=VALUE of the selected stack, with a stack file relative to the root; "" for the scenario's own stack."""
        return "" if self.choice is None else self.choice.relative_to_folder(self.root)

    @property
    def expectation(self) -> ExpectedFailure | None:
        """The failure that the scenario expects; its line is 0 if `expected` is in a file that the scenario extends."""
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
        """Return the position of the last of `keys` itself."""
        return key_position(self.tree, keys)

    def problem(self, keys: Keys, code: str, message: str, hint: str = "") -> Problem:
        """Return an error at the value of `keys`, with the text of its line."""
        return self.problem_at(self.position_of(*keys), code, message, hint)

    def problem_at(self, position: Position, code: str, message: str, hint: str = "") -> Problem:
        """Return an error at a position in any of the files, with the text of its line."""
        return self.with_source_line(Problem(*position, code=code, message=message, hint=hint))

    def with_source_line(self, problem: Problem) -> Problem:
        """Return a problem in any of the files with the text of its line."""
        lines = self.sources.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem
