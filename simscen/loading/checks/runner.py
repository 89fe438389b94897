"""Run the checks of names, settings, and meaning, which do not look at the geometry of the built world."""

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
    """Return the errors and warnings of a scenario with one robot.

    A scenario with several robots is checked once per robot: `loaded` is then the part that concerns one of them.
    `world` is the built world; it is needed only for the names in an imported world, e.g. from Gazebo. `unknown_places`
    are problems with names of places, which were found while the scenario was loaded. The meaning of the scenario is
    checked only if there are no errors in the names and in the world file.
    """
    problems = [*unknown_places, *NAMES.problems(NameScope(loaded, world)), *check_world_file(loaded.world)]
    if all(problem.severity == "warning" for problem in problems):
        problems += MEANING.problems(loaded)
    return [loaded.with_source_line(problem) for problem in problems]


def check_world_file(world: LoadedWorld) -> list[Problem]:
    """Return the errors and warnings of a world file. They do not contain the text of the source line yet."""
    return [] if world.spec is None else WORLD_FILE.problems(world)


def check_robot_names(spec: ScenarioSpec, tree: MappingNode) -> list[Problem]:
    """Return the problems with the names of robots. They do not contain the text of the source line yet."""
    return ROBOT_NAMES.problems(WrittenScenario(spec, tree))
