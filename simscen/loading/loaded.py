"""What loading yields: validated specifications, and the files they came from."""

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
from simscen.model.rosmap import RosMapSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import WorldSpec


@dataclass(frozen=True)
class LoadedMap:
    """A ROS map: `path` of its yaml, `image` of its pixels; `notes` are warnings about keys that mean nothing."""

    path: Path
    spec: RosMapSpec
    image: Path
    notes: tuple[Problem, ...] = ()


class JudgedMask(NamedTuple):
    """A filter mask that a criterion judges by: where its file is named first, and the map in it."""

    keys: tuple[Key, ...]
    map: LoadedMap


@dataclass(frozen=True)
class LoadedWorld:
    """A world: own (`spec`, perhaps on top of a `map` or an `sdf`), a ROS map alone, or an SDF file alone.

    `path` is the file that says so; the scenario's own for an inline world.
    """

    name: str
    path: Path
    spec: WorldSpec | None = None
    map: LoadedMap | None = None
    sdf: Path | None = None
    tree: MappingNode | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class LoadedRobot:
    """A robot: `spec` from a `*.robot.yaml`, `urdf` where it is built on one. A bare `.urdf` has no `spec`.

    `path` is the file the scenario named; `bundled` tells that simscen ships it; `packages` are the folders of ROS
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
    """A scenario that is right as far as can be told without building its world.

    `id` is its path without suffix relative to the root; `file` is absolute, `path` is `file` relative to the root as
    problems show it. `text` is the file as it was read. `map` is the map the robot gets: a ROS map, "none" for mapless
    driving, or None = what the world gives; `keepout_mask` and `speed_mask` are those of its stack, `judged_masks` what
    criteria judge by, by their files as written. `sources` holds the texts of all files
    read, by shown path, and `files` their absolute paths. `read` are the files that the world and the robot were made
    of besides, once they were built.
    `notes` are warnings. With `lenient`, what of an SDF world cannot be used is left out and noted.
    `choice` is the stack that was chosen in place of its own; it is part of the runs' keys where the session has
    `several_stacks`. `runs` is what an external stack runs, as far as anybody has said so.
    `variation` is the name of the variation that it is, "" for a file without: `spec` and `tree` hold its values, and
    `set_by` the path by which each of them came there, by its place.
    `robots` are its robots by name where there are several: each is the same scenario as one of this robot alone, whose
    name is `robot_name`, with `other_robots` about. What the whole says of a robot is then that of the first.
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
    set_by: Mapping[Position, str] = field(default_factory=dict, repr=False)
    robots: Mapping[str, "LoadedScenario"] = field(default_factory=dict)
    robot_name: str = ""
    other_robots: tuple[str, ...] = ()

    @property
    def each(self) -> Mapping[str, "LoadedScenario"]:
        """It as each of its robots sees it, by name; the only one has none."""
        return self.robots or {self.robot_name: self}

    def having(self, **changes: Any) -> "LoadedScenario":
        """The same with other values of fields, as each of its robots sees it, too."""
        robots = {name: view.having(**changes) for name, view in self.robots.items()}
        return replace(self, **changes, robots=robots)

    def concerns(self, robot: str | None) -> bool:
        """Whether what is said of a robot (None: of the only one, or of the world) may be about this one."""
        return robot is None or not self.robot_name or robot == self.robot_name

    @property
    def title(self) -> str:
        """What it is called: its id, with its variation."""
        return scenario_title(self.id, self.variation)

    @property
    def stack_name(self) -> str:
        """What tells its runs from those of the same scenario with other stacks."""
        return self.choice.name if self.choice is not None and self.several_stacks else ""

    @property
    def stack(self) -> str:
        """NAME=VALUE of the chosen stack, a file as seen from the root; "" = its own."""
        return "" if self.choice is None else self.choice.seen_from(self.root)

    @property
    def expectation(self) -> ExpectedFailure | None:
        """That it is known to fail, with the line that says so, where that is in its own file."""
        said = self.spec.expected
        if said is None:
            return None
        place = self.key_place_of("expected")
        return ExpectedFailure(said.fail, tuple(said.criteria), place.line if place.path == self.path else 0)

    def key(self, seed: int) -> RunKey:
        """The key of its run with this seed."""
        return RunKey(self.id, seed, self.variation, self.stack_name)

    def place_of(self, *keys: Key) -> Position:
        """Where the value at `keys` stands in its file, e.g. `place_of("goals", 0, "pose")`."""
        return value_position(self.tree, keys)

    def key_place_of(self, *keys: Key) -> Position:
        """Where the last of `keys` stands."""
        return key_position(self.tree, keys)

    def problem(self, keys: tuple[Key, ...], code: str, message: str, hint: str = "") -> Problem:
        """A problem at the value of `keys`, with the text of its line."""
        return self.problem_at(self.place_of(*keys), code, message, hint)

    def problem_at(self, place: Position, code: str, message: str, hint: str = "") -> Problem:
        """A problem at a place in any of the files read, with the text of its line."""
        return self.sourced(Problem(*place, code=code, message=message, hint=hint))

    def sourced(self, problem: Problem) -> Problem:
        """A problem in any of the files read with the text of its line."""
        lines = self.sources.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem
