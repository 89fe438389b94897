"""Runs the checks that do not need the built world: the stages WORLD_FILE, NAMES, and MEANING."""

from collections.abc import Iterable

from simscen.core.environment.world_model import World
from simscen.core.errors import Problem
from simscen.loading.checks import criteria, events, faults, names, settings, world_file
from simscen.loading.checks.registry import MEANING, NAMES, WORLD_FILE, NameScope
from simscen.loading.loaded import LoadedScenario, LoadedWorld

MODULES = (criteria, events, faults, names, settings, world_file)
"""Modules that register checks when they are imported."""


def check_scenario(
    loaded: LoadedScenario, world: World | None = None, unknown_places: Iterable[Problem] = ()
) -> list[Problem]:
    """Return the errors and warnings of a scenario of one robot, or of a view, including `unknown_places`.

    `world` is the built world. It is only needed to check names in a world from a ROS map or SDF file.
    """
    problems = [
        *unknown_places,
        *NAMES.problems(loaded.tree, NameScope(loaded, world)),
        *check_world_file(loaded.world),
    ]
    if all(problem.severity == "warning" for problem in problems):
        problems += MEANING.problems(loaded.tree, loaded)
    return [loaded.with_source_line(problem) for problem in problems]


def check_world_file(world: LoadedWorld) -> list[Problem]:
    """Return the errors and warnings of a world file, without source lines; [] for a ROS map or SDF file."""
    return [] if world.tree is None else WORLD_FILE.problems(world.tree, world.spec)
