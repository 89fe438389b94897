"""Registry of semantic checks, and the stages in which they run.

A check is a generator function that yields problems. It is registered for a stage with its error code:

    @MEANING.check("SC050")
    def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]: ...

The stages run in the order of the table. If a stage finds errors, later stages do not run, but NAMES runs even if
WORLD_FILE finds errors. If names come from a ROS map, an SDF file, or a URDF, NAMES and MEANING run again with the
built world. A view is the part of a scenario that concerns one robot.

| stage | subject | finds, for example | needs |
|---|---|---|---|
| ROBOT_NAMES | the scenario as written | unknown robots | nothing |
| WORLD_FILE | a world file | two objects with the same name | nothing |
| NAMES | one robot's view of the scenario | unknown goals or sensors | the files that it names |
| MEANING | one robot's view of the scenario | events that cannot happen | the files that it names |
| BUILT_WORLD (`built_world.py`) | a world file | places inside obstacles | the built world |
| WORLD (`scene.py`) | one robot's view of the scenario | goals without a route | the built world, the robot's size |
| TIMING (`scene.py`) | one robot's view of the scenario | time limits that are too short | the same |
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from simscen.core.environment.world_model import World
from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys, MappingNode, key_position, value_position
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import WorldSpec


class CheckProblem(NamedTuple):
    """Problem that a check has found, at the keys of a value instead of at a position in a file."""

    keys: Keys
    """Keys that lead to the value that the message marks, e.g. ("goals", 0, "pose")."""
    message: str
    hint: str = ""
    at_key: bool = False
    """Whether the message marks the last key instead of its value."""
    warning: bool = False
    """Whether this problem is a warning, although the check reports errors."""
    tree: MappingNode | None = None
    """YAML tree that contains `keys`, such as the robot file; None for the tree of the subject."""

    def problem(self, code: str, tree: MappingNode, severity: str = "error") -> Problem:
        """Return the problem with its position, but without its source line. `tree` is the YAML tree of the subject."""
        position_of = key_position if self.at_key else value_position
        position = position_of(self.tree or tree, self.keys)
        return Problem(*position, code, self.message, self.hint, "warning" if self.warning else severity)


class Subject(Protocol):
    """Object that the checks of a stage examine, such as a loaded scenario."""

    @property
    def tree(self) -> MappingNode:
        """YAML tree in which problems are reported."""
        ...


AnySubject = TypeVar("AnySubject", bound=Subject)
Check = Callable[[AnySubject], Iterable[CheckProblem]]
CheckFunction = TypeVar("CheckFunction", bound=Callable[..., Any])


@dataclass
class CheckStage(Generic[AnySubject]):
    """Checks that run together, in the order of their registration."""

    checks: list[tuple[str, str, Check[AnySubject]]] = field(default_factory=list)
    """Error code, severity, and function of each check."""

    def check(self, code: str, severity: str = "error") -> Callable[[CheckFunction], CheckFunction]:
        """Register the decorated function as a check that reports problems with this code."""

        def register(function: CheckFunction) -> CheckFunction:
            self.checks.append((code, severity, function))
            return function

        return register

    def problems(self, subject: AnySubject) -> list[Problem]:
        """Return the problems of a subject, without source lines."""
        return [
            found.problem(code, subject.tree, severity)
            for code, severity, function in self.checks
            for found in function(subject)
        ]


class WrittenScenario(NamedTuple):
    """Scenario with all its robots, before it is split into views."""

    spec: ScenarioSpec
    tree: MappingNode


class WorldFile(NamedTuple):
    """Specification of a world in a `*.world.yaml` or a scenario, and its YAML tree."""

    spec: WorldSpec
    tree: MappingNode


class NameScope(NamedTuple):
    """View of a scenario whose names are checked. `world` is the built world; None before it is built."""

    loaded: LoadedScenario
    world: World | None = None

    @property
    def tree(self) -> MappingNode:
        """YAML tree of the view."""
        return self.loaded.tree


ROBOT_NAMES: CheckStage[WrittenScenario] = CheckStage()
WORLD_FILE: CheckStage[WorldFile] = CheckStage()
NAMES: CheckStage[NameScope] = CheckStage()
MEANING: CheckStage[LoadedScenario] = CheckStage()
"""Stages of the table above. The module `runner` runs them."""
