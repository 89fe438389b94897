"""From paths on the command line to scenarios that can run."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from simscen.cli.diagnostics import from_here, harmless
from simscen.core.errors import InvalidInput, NothingSelected, UsageError
from simscen.core.filesread import files_read
from simscen.core.problems import Problem
from simscen.loading.discovery import default_root, discover
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.robotfile import load_robot_file
from simscen.loading.scenario import try_scenario
from simscen.loading.worldfile import load_world_file
from simscen.run.precheck.feasibility import check, notes_of
from simscen.run.precheck.worldchecks import misnamed
from simscen.run.robotproblems import problems_once_built
from simscen.run.worldcache import WorldCache
from simscen.run.worldsource import world_of


@dataclass(frozen=True)
class Selection:
    """Which scenarios a command is about: `keyword` and `tags` as for pytest, `shard` as (i, n) from (1, n)."""

    keyword: str = ""
    tags: Sequence[str] = ()
    shard: tuple[int, int] = (1, 1)


def load_all(
    paths: Sequence[Path], root: Path | None, world_path: Sequence[Path], lenient: bool, wanted: Selection
) -> tuple[list[LoadedScenario], list[Problem]]:
    """The selected scenarios, all of them valid, and warnings about them, each once.

    Raises InvalidInput with every problem of every file, selected or not, and NothingSelected.
    """
    home = root if root is not None else default_root(paths)
    checks = Checks(home, world_path, lenient)
    loaded: list[LoadedScenario] = []
    problems: dict[Problem, None] = {}
    warnings: dict[str, list[Problem]] = {}
    for file in discover(paths, home):
        scenario, found = checks.scenario(file)
        if scenario is not None:
            loaded.append(scenario)
            warnings[scenario.id] = found
        problems.update(dict.fromkeys(found))
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(from_here(problems, home))
    chosen = _shard(select(loaded, wanted.keyword, wanted.tags), *wanted.shard)
    told = dict.fromkeys(warning for scenario in chosen for warning in warnings[scenario.id])
    return chosen, from_here(told, home)


def shard_of(text: str) -> tuple[int, int]:
    """`i/n` as numbers. Raises UsageError."""
    number, slash, count = text.partition("/")
    if slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count):
        return int(number), int(count)
    raise UsageError(f"cannot read --shard {harmless(text)}: expected i/n with 1 <= i <= n, e.g. 2/4")


def _shard(scenarios: list[LoadedScenario], number: int, count: int) -> list[LoadedScenario]:
    """Every n-th scenario, so that folders with slow ones are spread over all shards."""
    share = scenarios[number - 1 :: count]
    if not share:
        raise NothingSelected(f"shard {number}/{count} of {len(scenarios)} scenarios is empty")
    return share


@dataclass(frozen=True)
class Checks:
    """Looks at files for all that can be wrong with them; with `fast`, for nothing that geometry is needed for.

    Into the folder `pictures` goes a picture of each scenario that geometry finds something wrong with.
    """

    root: Path
    world_path: Sequence[Path] = ()
    lenient: bool = False
    fast: bool = False
    pictures: Path | None = None
    cache: WorldCache = field(default_factory=WorldCache)

    def scenario(self, file: Path) -> tuple[LoadedScenario | None, list[Problem]]:
        """The scenario, unless it is unusable, and its problems: a usable one has none that are errors."""
        loaded = try_scenario(file, self.root, self.world_path)
        if isinstance(loaded, list):
            return None, loaded
        loaded = replace(loaded, lenient=self.lenient)
        with files_read() as read:
            problems = [*loaded.notes, *([] if self.fast else checked(loaded, self.cache, self.pictures))]
        loaded = replace(loaded, read=tuple(sorted(read)))
        usable = not any(problem.severity == "error" for problem in problems)
        return (loaded if usable else None), list(dict.fromkeys(problems))

    def world(self, file: Path) -> list[Problem]:
        """What only building a world can tell, or why it cannot be used."""
        try:
            source = load_world_file(file, self.root, self.world_path)
            notes = list(source.map.notes) if source.map else []
            if self.fast:
                return notes
            world = world_of(source, self.root, self.world_path, self.lenient)
            return [*notes, *misnamed(world, source), *notes_of(world, source, self.root)]
        except InvalidInput as error:
            return error.problems

    def robot(self, file: Path) -> list[Problem]:
        """What only building a robot can tell, or why it cannot be used."""
        if self.fast:
            return []
        try:
            return problems_once_built(load_robot_file(str(file), self.root, self.world_path))
        except InvalidInput as error:
            return error.problems


def checked(scenario: LoadedScenario, cache: WorldCache | None = None, pictures: Path | None = None) -> list[Problem]:
    """What only geometry can tell, or why its world cannot be used."""
    try:
        return check(scenario, cache, pictures)
    except InvalidInput as error:
        return error.problems
