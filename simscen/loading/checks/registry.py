"""Interface of semantic checks, and the stages in which checks run.

A check is a generator function that yields a CheckProblem for each problem, and is named after what it finds. It is
registered for a stage together with the error code that it reports:

    @MEANING.check("SC050")
    def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]: ...

These are the stages in the order in which they run. If a stage finds errors, later stages do not run, except that NAMES
always runs with WORLD_FILE.

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
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.loading.yaml.tree import Keys, MappingNode, key_position, value_position
from simscen.model.scenario import ScenarioSpec


class CheckProblem(NamedTuple):
    """Problem that a check found, by keys instead of a position in a file."""

    keys: Keys
    """Keys of the value to mark."""
    message: str
    """What is wrong."""
    hint: str = ""
    """What to do."""
    at_key: bool = False
    """Whether to mark the key itself instead of its value."""
    warning: bool = False
    """Whether this is a warning even if the check is registered for errors."""
    tree: MappingNode | None = None
    """Tree that `keys` refer to, such as that of the robot file; None for the tree of the subject of the check."""

    def problem(self, code: str, tree: MappingNode, severity: str = "error") -> Problem:
        """Return the problem with its position in `tree`, the tree of the subject, but without its source line."""
        position_of = key_position if self.at_key else value_position
        position = position_of(self.tree or tree, self.keys)
        return Problem(*position, code, self.message, self.hint, "warning" if self.warning else severity)


class Subject(Protocol):
    """Object that the checks of a stage examine. It has the tree of the file in which problems are reported."""

    @property
    def tree(self) -> MappingNode | None:
        """The tree of the file; None for a file that is not in simscen's language, which is not checked."""
        ...


S = TypeVar("S", bound=Subject)
Check = Callable[[S], Iterable[CheckProblem]]
"""Function that yields the problems of a subject."""
C = TypeVar("C", bound=Callable[..., Any])


@dataclass
class CheckStage(Generic[S]):
    """Checks that run together, in the order in which they were registered."""

    name: str
    checks: list[tuple[str, str, Check[S]]] = field(default_factory=list)
    """Error code, severity and function of each check."""

    def check(self, code: str, severity: str = "error") -> Callable[[C], C]:
        """Register the decorated function as a check that reports problems with this code."""

        def register(function: C) -> C:
            self.checks.append((code, severity, function))
            return function

        return register

    def problems(self, subject: S) -> list[Problem]:
        """Return the problems that all checks of this stage find, without their source lines."""
        tree = subject.tree
        if tree is None:
            return []
        return [
            found.problem(code, tree, severity)
            for code, severity, function in self.checks
            for found in function(subject)
        ]


class WrittenScenario(NamedTuple):
    """Scenario as written, with all its robots, before it is split into views."""

    spec: ScenarioSpec
    tree: MappingNode


class NameScope(NamedTuple):
    """View of a scenario, and its built world, in which names are looked up. `world` is None before it is built."""

    loaded: LoadedScenario
    world: World | None = None

    @property
    def tree(self) -> MappingNode:
        """The tree of the scenario."""
        return self.loaded.tree


ROBOT_NAMES: CheckStage[WrittenScenario] = CheckStage("robot names")
WORLD_FILE: CheckStage[LoadedWorld] = CheckStage("world file")
NAMES: CheckStage[NameScope] = CheckStage("names")
MEANING: CheckStage[LoadedScenario] = CheckStage("meaning")
