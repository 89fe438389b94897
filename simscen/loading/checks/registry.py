"""Registry of semantic checks, and the stages in which they run.

A check is a generator function that yields problems. It is registered for a stage with its error code:

    @MEANING.check("SC050")
    def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]: ...

The stages run in the order of the table. If a stage finds errors, later stages do not run. Exception: NAMES runs even
if WORLD_FILE finds errors. If names come from a ROS map, an SDF file, or a URDF, NAMES and MEANING run again with the
built world. A view is the part of a scenario that applies to one robot.

| stage | subject | finds, for example |
|---|---|---|
| ROBOT_NAMES | ScenarioSpec of all robots | unknown robots |
| WORLD_FILE | WorldSpec | two objects with the same name |
| NAMES | NameScope | unknown goals or sensors |
| MEANING | LoadedScenario: a view | events that cannot happen |
| BUILT_WORLD | the built World, and its WorldSpec | places inside obstacles |
| WORLD | Scene: a view in the built world | goals without a route |
| TIMING | Scene | time limits that are too short |
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

from simscen.core.environment.world_model import World
from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys, MappingNode, key_position, value_position


class CheckProblem(NamedTuple):
    """Problem that a check has found. Its place is given by the keys of a value instead of a position in a file."""

    keys: Keys
    """Keys that lead to the value that the message marks, e.g. ("goals", 0, "pose")."""
    message: str
    hint: str = ""
    at_key: bool = False
    """Whether the message marks the last key instead of its value."""
    is_warning: bool = False
    """Whether this problem is a warning, although the other problems of the check are errors."""
    tree: MappingNode | None = None
    """YAML tree that contains `keys`, such as the robot file; None for the tree that the stage checks."""

    def problem(self, code: str, tree: MappingNode, severity: str = "error") -> Problem:
        """Return the problem with its position in `tree`, but without its source line."""
        position_of = key_position if self.at_key else value_position
        position = position_of(self.tree or tree, self.keys)
        return Problem(*position, code, self.message, self.hint, "warning" if self.is_warning else severity)


CheckFunction = TypeVar("CheckFunction", bound=Callable[..., Iterable[CheckProblem]])


@dataclass(frozen=True)
class CheckStage:
    """Checks that run together, in the order of their registration."""

    checks: list[tuple[str, str, Callable[..., Iterable[CheckProblem]]]] = field(default_factory=list)
    """Error code, severity, and function of each check."""

    def check(self, code: str, severity: str = "error") -> Callable[[CheckFunction], CheckFunction]:
        """Register the decorated function as a check that reports problems with this code."""

        def register(function: CheckFunction) -> CheckFunction:
            self.checks.append((code, severity, function))
            return function

        return register

    def problems(self, tree: MappingNode, *subject: Any) -> list[Problem]:
        """Return the problems that the checks find, without source lines.

        Each check is called with the arguments `subject`. The keys of its problems lead to values in the YAML `tree`.
        """
        return [
            found.problem(code, tree, severity)
            for code, severity, function in self.checks
            for found in function(*subject)
        ]


class NameScope(NamedTuple):
    """View of a scenario whose names are checked. `world` is the built world; None before the world is built."""

    loaded: LoadedScenario
    world: World | None = None


ROBOT_NAMES, WORLD_FILE, NAMES, MEANING = CheckStage(), CheckStage(), CheckStage(), CheckStage()
BUILT_WORLD, WORLD, TIMING = CheckStage(), CheckStage(), CheckStage()
"""Stages of the table above. `load_scenario` runs ROBOT_NAMES; the modules `runner` and `scene_runner` run the others.
"""
