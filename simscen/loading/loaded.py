"""Loaded scenarios, worlds, robots, and maps: the validated specifications with their files and YAML trees."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import yaml

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.core.records.disturbances import Disturbance
from simscen.core.records.run_result import RunKey, scenario_title
from simscen.core.records.verdict import ExpectedFailure
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.yaml.textfile import with_source_line
from simscen.loading.yaml.tree import Key, Keys, MappingNode, Position, child, key_position, node_at, value_position
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec, expected_failure
from simscen.model.world import RosMapSpec, WorldSpec

if TYPE_CHECKING:
    from simscen.model.disturbances import LocatedAction

KEEPOUT_MASK_KEYS: Keys = ("stack", "keepout_mask")
"""Keys that lead to the keepout mask of the stack in a scenario."""
SPEED_MASK_KEYS: Keys = ("stack", "speed_mask", "file")
"""Keys that lead to the speed mask of the stack in a scenario."""


@dataclass(frozen=True)
class LoadedMap:
    """ROS map: its YAML file `path`, its `image` file, and warnings about keys without effect (`notes`)."""

    path: Path
    spec: RosMapSpec
    image: Path
    notes: tuple[Problem, ...] = ()


class CriterionMask(NamedTuple):
    """Filter mask of a criterion. `keys` lead to its first use in the scenario."""

    keys: Keys
    map: LoadedMap


@dataclass(frozen=True)
class LoadedWorld:
    """World from a `*.world.yaml` (with or without a ROS map or SDF file), or from a ROS map or SDF file alone."""

    name: str
    path: Path
    """File of the world; for an inline world, the file of the scenario."""
    spec: WorldSpec | None = None
    """Specification; None for a ROS map or SDF file alone."""
    map: LoadedMap | None = None
    """ROS map; None without a map."""
    sdf: Path | None = None
    """SDF file, which is not parsed yet; None without one."""
    tree: MappingNode | None = field(default=None, repr=False, compare=False)
    """YAML tree of `spec`."""


@dataclass(frozen=True)
class LoadedRobot:
    """Robot from a `*.robot.yaml`, or from a URDF alone."""

    name: str
    path: Path
    spec: RobotSpec | None = None
    """Specification; None for a URDF alone."""
    urdf: Path | None = None
    """URDF or xacro file: the one that the `*.robot.yaml` names, or `path` itself; None without one."""
    tree: MappingNode | None = field(repr=False, default=None)
    """YAML tree of `spec`."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    """Folders of ROS packages by name, as the `*.robot.yaml` lists them."""


@dataclass(frozen=True)
class LoadedScenario:
    """Valid scenario, or valid variation of a scenario. All checks that do not need its built world have passed.

    A scenario of several robots has a view of each robot: a scenario with this robot alone. The `spec`, `tree`, and
    `notes` of the scenario itself cover all robots. Only the views have an `external_command`. The other fields are the
    same as in the first view.
    """

    id: str
    """Path relative to the root, without suffix."""
    path: str
    """Path relative to the root, as in messages."""
    file: Path
    """Absolute path."""
    root: Path
    """Folder in which all files of the scenario must lie, except files in `world_path`."""
    world_path: tuple[Path, ...]
    """Folders of `--world-path`, in which files are searched that the root does not contain."""
    text: str
    """Text of the file."""
    spec: ScenarioSpec
    """Specification, with poses instead of place names."""
    world: LoadedWorld
    map: LoadedMap | Literal["none"] | None
    """ROS map that the robot uses; "none" for no map, None for the map of the world."""
    robot: LoadedRobot
    tree: MappingNode = field(repr=False)
    """YAML tree of the scenario: all files merged, with the values of the variation and the selected stack."""
    sources: Mapping[str, str] = field(repr=False, default_factory=dict)
    """Texts of all YAML files of the scenario, by path as in messages."""
    files: Mapping[str, Path] = field(default_factory=dict)
    """Absolute paths of the same files, by path as in messages."""
    read_files: tuple[Path, ...] = ()
    """Other files that were read to build the world and the robot, such as meshes."""
    notes: tuple[Problem, ...] = ()
    """Warnings about the files."""
    lenient: bool = False
    """Whether unusable parts of an SDF world are skipped with a warning, instead of being errors."""
    keepout_mask: LoadedMap | None = None
    """Filter mask of the stack's keepout zones; None without one."""
    speed_mask: LoadedMap | None = None
    """Filter mask of the stack's speed limits; None without one."""
    criterion_masks: Mapping[str, CriterionMask] = field(default_factory=dict)
    """Filter masks of criteria, by path as written in the scenario."""
    choice: StackChoice | None = None
    """Stack selected on the command line; None for the stack of the scenario."""
    has_several_stacks: bool = False
    """Whether the session runs the scenario with several stacks."""
    external_command: ExternalCommand | None = None
    """Command that starts the external stack; None for another stack, or if no command is defined."""
    variation: str = ""
    """Name of the variation; "" for a file without variations."""
    varied_values: Mapping[str, Any] = field(default_factory=dict, repr=False)
    """Values of the variation, by dotted path."""
    varied_paths: Mapping[Position, str] = field(default_factory=dict, repr=False)
    """Dotted path of each value of the variation, by position of the value in a file."""
    robots: Mapping[str, "LoadedScenario"] = field(default_factory=dict)
    """Views by name of the robot; {} for a scenario of one robot."""
    robot_name: str = ""
    """In a view, the name of its robot; otherwise ""."""
    other_robots: tuple[str, ...] = ()
    """In a view, the names of the other robots; otherwise ()."""

    @property
    def robot_views(self) -> Mapping[str, "LoadedScenario"]:
        """The views by name of the robot; for a scenario of one robot, the scenario itself under ""."""
        return self.robots or {self.robot_name: self}

    def with_changes(self, **changes: Any) -> "LoadedScenario":
        """Return a copy of the scenario with these fields changed, also in its views."""
        robots = {name: view.with_changes(**changes) for name, view in self.robots.items()}
        return replace(self, **changes, robots=robots)

    def as_skipped(self, choice: StackChoice, reason: str) -> "LoadedScenario":
        """Return a copy of the scenario with the stack `choice`, marked as skipped for this reason."""
        return replace(self, choice=choice, spec=self.spec.model_copy(update={"skip": reason}))

    def includes_robot(self, robot: str | None) -> bool:
        """Return whether this view includes the parts of the scenario that name `robot`, or that name no robot."""
        return robot is None or not self.robot_name or robot == self.robot_name

    def may_do(self, *kinds: str) -> bool:
        """Return whether an action of an event can have the effect of an action of one of these kinds.

        Actions of installed packages can have any effect. Without kinds, return whether an action is from such a
        package.
        """
        return any(action.choice.may_do(*kinds) for action in self.all_actions)

    @property
    def all_actions(self) -> "list[LocatedAction]":
        """Actions of all events in order. In a view, they include actions on other robots."""
        return [action for step in self.spec.steps for action in step.actions]

    @property
    def actions(self) -> "list[LocatedAction]":
        """Actions of all events in order, without actions on the robots of other views."""
        return [action for action in self.all_actions if self.includes_robot(action.choice.robot)]

    @property
    def title(self) -> str:
        """The id with the name of the variation, e.g. `aisle[speed=0.5]`."""
        return scenario_title(self.id, self.variation)

    @property
    def stack_name(self) -> str:
        """Name of the stack in run keys; "" unless the session runs the scenario with several stacks."""
        return self.choice.name if self.choice is not None and self.has_several_stacks else ""

    @property
    def stack(self) -> str:
        """The value of `--stack`, with file paths relative to the root; "" for the stack of the scenario."""
        return "" if self.choice is None else self.choice.relative_to_folder(self.root)

    @property
    def expected_failure(self) -> ExpectedFailure | None:
        """The failure that the scenario expects; None for none. `line` is 0 if `expected` is in an extended file."""
        failure, position = expected_failure(self.spec), self.key_position_of("expected")
        return failure and replace(failure, line=position.line if position.path == self.path else 0)

    @property
    def disturbances(self) -> tuple[Disturbance, ...]:
        """The events, each followed by the steps of its sequence, and then the faults. Logs contain them."""
        events = [
            self._disturbance("event", step.name, step.keys, step.required, step.after) for step in self.spec.steps
        ]
        faults = [
            self._disturbance("fault", fault.label, ("faults", index), fault.required)
            for index, fault in enumerate(self.spec.faults)
        ]
        return (*events, *faults)

    def _disturbance(
        self, kind: Literal["event", "fault"], name: str, keys: Keys, required: bool, after: int | None = None
    ) -> Disturbance:
        """Return the event or fault at `keys`. `line` is 0 if the event or fault is in an extended file."""
        node = node_at(self.tree, keys)
        when, position = child(node, "when"), node.position
        text = ""
        if when is not None:
            text = yaml.safe_dump(when.plain, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9)
        line = position.line if position.path == self.path else 0
        return Disturbance(name, kind, text.strip().removeprefix("{").removesuffix("}"), required, line, after)

    def key(self, seed: int) -> RunKey:
        """Return the key of the run with this seed."""
        return RunKey(self.id, seed, self.variation, self.stack_name)

    def position_of(self, *keys: Key) -> Position:
        """Return the position of the value at `keys`, e.g. `position_of("goals", 0, "pose")`."""
        return value_position(self.tree, keys)

    def key_position_of(self, *keys: Key) -> Position:
        """Return the position of the last key of `keys`, before its value."""
        return key_position(self.tree, keys)

    def problem(self, keys: Keys, code: str, message: str, hint: str = "") -> Problem:
        """Return an error at the position of the value at `keys`, with the text of its line."""
        return self.with_source_line(Problem(*self.position_of(*keys), code, message, hint))

    def with_source_line(self, problem: Problem) -> Problem:
        """Return a copy of a problem with the text of its line in any file of the scenario."""
        return with_source_line(problem, self.sources)
