"""From paths on the command line to scenarios that can run."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

from simscen.cli.diagnostics import from_here, harmless
from simscen.cli.session.stacks import Stacks, stacks_of
from simscen.core.errors import InvalidInput, NothingSelected, UsageError
from simscen.core.filesread import files_read
from simscen.core.problems import Problem
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.files.robotfile import load_robot_file
from simscen.loading.files.worldfile import load_world_file
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.variations.problems import VariationProblems, merge_problems
from simscen.run.robotproblems import problems_once_built
from simscen.run.worldcache import WorldCache
from simscen.run.worldchecks.runner import check_in_world, world_reader_notes
from simscen.run.worldchecks.world_file import check_world_places
from simscen.run.worldsource import world_of


@dataclass(frozen=True)
class Selection:
    """Which scenarios a command is about: `keyword` and `tags` as for pytest, `shard` as (i, n) from (1, n).

    `variations` are names of those that are meant, of all scenarios; () = whatever they are called.
    """

    keyword: str = ""
    tags: Sequence[str] = ()
    shard: tuple[int, int] = (1, 1)
    variations: Sequence[str] = ()


def load_all(
    paths: Sequence[Path],
    root: Path | None,
    world_path: Sequence[Path],
    lenient: bool,
    wanted: Selection,
    stacks: Sequence[str] = (),
) -> tuple[list[LoadedScenario], list[Problem]]:
    """The selected scenarios, all of them valid, each variation with every one of `stacks`, and warnings about them.

    Raises InvalidInput with every problem of every file, selected or not, and NothingSelected.
    """
    home = root if root is not None else default_root(paths)
    checks = Checks(home, world_path, lenient, stacks=stacks_of(stacks, home, world_path))
    choices = checks.choices
    loaded: dict[str, list[LoadedScenario]] = {}
    problems: dict[Problem, None] = {}
    warnings: dict[str, list[Problem]] = {}
    for file, choice in product(discover(paths, home), choices):
        variations, found = checks.scenario(file, choice)
        for scenario in variations:
            loaded.setdefault(scenario.title, []).append(scenario.having(several_stacks=len(choices) > 1))
            warnings.setdefault(scenario.id, []).extend(found)
        problems.update(dict.fromkeys(found))
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(from_here(problems, home))
    firsts = varied([stacked[0] for stacked in loaded.values()], wanted.variations)
    chosen = _shard(select(firsts, wanted.keyword, wanted.tags), *wanted.shard)
    merge_problems = dict.fromkeys(warning for one in chosen for warning in warnings[one.id])
    return [stacked for one in chosen for stacked in loaded[one.title]], from_here(merge_problems, home)


def varied(scenarios: list[LoadedScenario], names: Sequence[str]) -> list[LoadedScenario]:
    """Those that are variations of one of these names; all where none is named. Raises NothingSelected."""
    known = dict.fromkeys(one.variation for one in scenarios if one.variation)
    if missing := [name for name in names if name not in known]:
        merge_problems = suggestion(missing[0], known) or "no scenario has variations"
        raise NothingSelected(f"no variation is called {quoted(missing[0], 120)}; {merge_problems}")
    return [one for one in scenarios if not names or one.variation in names]


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

    Into the folder `pictures` goes a picture of each scenario that geometry finds something wrong with. Unless `runs`,
    it is no mistake that nobody here says what an external stack is: others may.
    """

    root: Path
    world_path: Sequence[Path] = ()
    lenient: bool = False
    fast: bool = False
    pictures: Path | None = None
    cache: WorldCache = field(default_factory=WorldCache)
    stacks: Stacks = field(default_factory=Stacks)
    runs: bool = True

    @property
    def choices(self) -> Sequence[StackChoice | None]:
        """The stacks to look at each scenario with; None = its own."""
        return self.stacks.chosen or (None,)

    def scenario(self, file: Path, choice: StackChoice | None = None) -> tuple[Sequence[LoadedScenario], list[Problem]]:
        """The variations of a scenario, none where one is unusable, and its problems: usable ones have no errors."""
        loaded = try_variations(file, self.root, self.world_path, choice)
        if isinstance(loaded, list):
            return (), loaded
        tried = [self._variation(one) for one in loaded]
        problems = merge_problems(
            [VariationProblems(one.variation, one.set_by, found) for one, (_, found) in zip(loaded, tried, strict=True)]
        )
        usable = [one for one, _ in tried if one is not None]
        return (usable if len(usable) == len(tried) else ()), problems

    def _variation(self, loaded: LoadedScenario) -> tuple[LoadedScenario | None, list[Problem]]:
        loaded, nobody = self.stacks.with_command(loaded.having(lenient=self.lenient))
        if nobody and self.runs:
            return None, [*loaded.notes, *nobody]
        with files_read() as read:
            problems = [*loaded.notes, *([] if self.fast else checked(loaded, self.cache, self.pictures))]
        problems += [replace(problem, severity="warning") for problem in nobody]
        loaded = loaded.having(read=tuple(sorted(read)))
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
            return [*notes, *check_world_places(world, source), *world_reader_notes(world, source, self.root)]
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
        return check_in_world(scenario, cache, pictures)
    except InvalidInput as error:
        return error.problems
