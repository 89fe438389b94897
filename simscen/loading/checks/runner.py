"""Run the checks that need no built world."""

from collections.abc import Iterable

from simscen.core.environment.world_model import World
from simscen.core.errors import Problem
from simscen.loading.checks import actions, criteria, events, faults, names, settings, world_file
from simscen.loading.checks.registry import MEANING, NAMES, ROBOT_NAMES, WORLD_FILE, NameScope, WrittenScenario
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.loading.yaml.tree import MappingNode
from simscen.model.scenario import ScenarioSpec

MODULES = (actions, criteria, events, faults, names, settings, world_file)
"""Modules that register checks when they are imported."""


def check_scenario(
    loaded: LoadedScenario, world: World | None = None, unknown_places: Iterable[Problem] = ()
) -> list[Problem]:
    """Return the problems of a scenario of one robot, or as one of several robots sees it; some are warnings.

    `world` is the built world, if the names of an imported world are needed. `unknown_places` are problems with names
    of places, which are found while the scenario is loaded. The meaning is checked only if all names are known.
    """
    problems = [*unknown_places, *NAMES.problems(NameScope(loaded, world)), *check_world_file(loaded.world)]
    if all(problem.severity == "warning" for problem in problems):
        problems += MEANING.problems(loaded)
    return [loaded.with_source_line(problem) for problem in problems]


def check_world_file(world: LoadedWorld) -> list[Problem]:
    """Return the problems of a world file, without the text of their lines; some are warnings."""
    return [] if world.spec is None else WORLD_FILE.problems(world)


def check_robot_names(spec: ScenarioSpec, tree: MappingNode) -> list[Problem]:
    """Return the problems with the names of robots in a scenario, without the text of their lines."""
    return ROBOT_NAMES.problems(WrittenScenario(spec, tree))
