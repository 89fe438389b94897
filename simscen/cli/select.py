"""From paths on the command line to scenarios that can run."""

from collections.abc import Sequence
from pathlib import Path

from simscen.cli.diagnostics import from_here
from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.loading.discovery import default_root, discover
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_scenario
from simscen.loading.selection import select
from simscen.run.check import check


def load_all(
    paths: Sequence[Path], root: Path | None, world_path: Sequence[Path], keyword: str, tags: Sequence[str]
) -> list[LoadedScenario]:
    """The selected scenarios, all of them valid.

    Raises InvalidInput with every problem of every file, selected or not, and NothingSelected.
    """
    home = root if root is not None else default_root(paths)
    loaded: list[LoadedScenario] = []
    problems: list[Problem] = []
    for file in discover(paths, home):
        scenario = try_scenario(file, home, world_path)
        if isinstance(scenario, LoadedScenario):
            loaded.append(scenario)
            scenario = checked(scenario)
        problems += [problem for problem in scenario if problem not in problems]
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(from_here(problems, home))
    return select(loaded, keyword, tags)


def checked(scenario: LoadedScenario) -> list[Problem]:
    """What only geometry can tell, or why its world cannot be used."""
    try:
        return check(scenario)
    except InvalidInput as error:
        return error.problems
