"""Selection of a session's scenarios, and their division over machines."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from statistics import median
from typing import NamedTuple

from simscen.cli.diagnostics import escaped, relative_to_working_folder
from simscen.cli.session.stacks import Stacks, stacks_of
from simscen.core.errors import InvalidInput, NothingSelected, Problem, UsageError
from simscen.core.files import collect_read_files
from simscen.loading.builders import world_from_file
from simscen.loading.checks.built_world import check_built_world
from simscen.loading.checks.robot_geometry import robot_problems
from simscen.loading.checks.scene_runner import check_in_world, world_reader_notes
from simscen.loading.codes import STACK_CANNOT
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.files.paths import is_folder
from simscen.loading.files.single_files import load_robot_file, load_world_file
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.variations.naming import number_of
from simscen.loading.variations.variation_problems import VariationProblems, merge_problems
from simscen.loading.world_cache import WorldCache


class _ParallelJob(NamedTuple):
    """Environment variables of a CI system with the number of a job, the number of jobs, and the first number.

    `first` is the first number in a system without a variable for it.
    """

    index_variable: str
    count_variable: str
    first_variable: str = ""
    first: int = 0


PARALLEL_JOBS = (
    _ParallelJob("CI_NODE_INDEX", "CI_NODE_TOTAL", first=1),  # GitLab
    _ParallelJob("CIRCLE_NODE_INDEX", "CIRCLE_NODE_TOTAL"),
    _ParallelJob("BUILDKITE_PARALLEL_JOB", "BUILDKITE_PARALLEL_JOB_COUNT"),
    _ParallelJob("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN"),
    _ParallelJob("JOB_COMPLETION_INDEX", "JOB_COMPLETIONS"),  # Kubernetes; the second is set by the user
)


def shard_of(text: str, environ: Mapping[str, str]) -> tuple[int, int]:
    """Parse `i/n`, or find both in the environment for `auto`. Raises UsageError."""
    text = _parallel_job(environ) if text == "auto" else text
    number, slash, count = text.partition("/")
    if slash and text.isascii() and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count):
        return int(number), int(count)
    raise UsageError(f"cannot read --shard {escaped(text)}: expected i/n with 1 <= i <= n, e.g. 2/4")


def _parallel_job(environ: Mapping[str, str]) -> str:
    for job in PARALLEL_JOBS:
        index, count = environ.get(job.index_variable, ""), environ.get(job.count_variable, "")
        first = environ.get(job.first_variable, str(job.first))
        if index.isdecimal() and count.isdecimal() and first.isdecimal():
            return f"{int(index) - int(first) + 1}/{count}"
    known = ", ".join(job.index_variable for job in PARALLEL_JOBS)
    raise UsageError(f"--shard auto: none of these variables and its count are set: {known}; use --shard i/n")


def share_of_scenarios(
    scenarios: list[LoadedScenario], number: int, count: int, times: Mapping[str, float]
) -> list[LoadedScenario]:
    """Return the scenarios of shard `number` of `count`, in their order. Raises NothingSelected if there are none.

    `times` are seconds by the title of the scenario. Without any, each shard gets every n-th scenario, so that folders
    with slow scenarios are spread. Otherwise, the longest scenario goes to the shard with the least work, and so on
    (longest processing time first); a scenario without a time counts as the median.
    """
    if times and count > 1:
        default = median(times.values())
        seconds = [times.get(scenario.title, default) for scenario in scenarios]
        work, shards = [0.0] * count, [0] * len(scenarios)
        for index in sorted(range(len(scenarios)), key=lambda index: -seconds[index]):
            shards[index] = min(range(count), key=work.__getitem__)
            work[shards[index]] += seconds[index]
        share = [scenario for index, scenario in enumerate(scenarios) if shards[index] == number - 1]
    else:
        share = scenarios[number - 1 :: count]
    if not share:
        raise NothingSelected(f"shard {number}/{count} of {len(scenarios)} scenarios is empty")
    return share


def scenario_times(folders: Sequence[Path]) -> dict[str, float]:
    """Return the mean wall-clock seconds of a run by the title of its scenario, from earlier output folders.

    Raises InvalidInput if a folder has no journal.
    """
    from simscen.report.journal_reader import (
        read_journal,  # light commands, which also select scenarios, do not need it
    )

    wall_times = defaultdict(list)
    for folder in folders:
        for run in read_journal(folder).finished.values():
            wall_times[run.key.test].append(run.wall)
    return {title: sum(times) / len(times) for title, times in wall_times.items()}


@dataclass(frozen=True)
class Selection:
    """Filter of scenarios: `keyword` and `tags` as in pytest, `shard` (i, n) with 1 <= i <= n.

    `variations` are names of variations; () selects all. `times` are the seconds of scenarios in earlier runs; shards
    are balanced by them.
    """

    keyword: str = ""
    tags: Sequence[str] = ()
    shard: tuple[int, int] = (1, 1)
    variations: Sequence[str] = ()
    times: Mapping[str, float] = field(default_factory=dict)

    @property
    def numbers(self) -> list[int] | None:
        """Numbers of the selected variations, if all are selected by number (`variation-7`)."""
        numbers = [number for name in self.variations if (number := number_of(name)) is not None]
        return numbers if numbers and len(numbers) == len(self.variations) else None


def load_all(
    paths: Sequence[Path],
    root: Path | None,
    world_path: Sequence[Path],
    lenient: bool,
    selection: Selection,
    stacks: Sequence[str] = (),
) -> tuple[list[LoadedScenario], list[Problem]]:
    """Return the selected scenarios, each variation with each of `stacks`, and warnings about them.

    A scenario that one of `stacks` cannot run is marked to be skipped if it was found in a folder; if it is one of
    `paths`, it is invalid. Raises InvalidInput with the problems of all files, whether selected or not, and
    NothingSelected.
    """
    root_folder = root if root is not None else default_root(paths)
    checks = Checks(root_folder, world_path, lenient, stacks=stacks_of(stacks, root_folder, world_path))
    choices = checks.choices
    loaded: dict[str, list[LoadedScenario]] = {}
    problems: dict[Problem, None] = {}
    warnings: dict[str, list[Problem]] = {}
    named = {path.absolute() for path in paths if not is_folder(path)}
    for file, choice in product(discover(paths, root_folder), choices):
        variations, found = checks.scenario(file, choice, selection.numbers)
        if choice is not None and file not in named and (reason := impossible_with(choice, found)):
            variations, found = checks.scenario(file, None, selection.numbers)
            variations = [one.skipped(choice, reason) for one in variations]
        for scenario in variations:
            loaded.setdefault(scenario.title, []).append(scenario.with_changes(several_stacks=len(choices) > 1))
            warnings.setdefault(scenario.id, []).extend(found)
        problems.update(dict.fromkeys(found))
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(relative_to_working_folder(problems, root_folder))
    unique = select_variations([with_stacks[0] for with_stacks in loaded.values()], selection.variations)
    selected = share_of_scenarios(select(unique, selection.keyword, selection.tags), *selection.shard, selection.times)
    relevant = dict.fromkeys(warning for one in selected for warning in warnings[one.id])
    return [scenario for one in selected for scenario in loaded[one.title]], relative_to_working_folder(
        relevant, root_folder
    )


def impossible_with(choice: StackChoice, problems: Sequence[Problem]) -> str:
    """Return why a scenario cannot run with a stack; "" if it can, or if it has an error with any stack."""
    errors = [problem for problem in problems if problem.severity == "error"]
    if not errors or any(problem.code != STACK_CANNOT for problem in errors):
        return ""
    first = errors[0]
    return f"--stack {choice.name} cannot run it: {first.place}: {first.message}"


def select_variations(scenarios: list[LoadedScenario], names: Sequence[str]) -> list[LoadedScenario]:
    """Return the variations with one of these names; all if there are no names. Raises NothingSelected."""
    known = dict.fromkeys(one.variation for one in scenarios if one.variation)
    if missing := [name for name in names if name not in known]:
        if number_of(missing[0]) is not None:
            raise NothingSelected(f"no scenario has a {missing[0]} that meets the conditions in `require`")
        hint = suggestion(missing[0], known) or "no scenario has variations"
        raise NothingSelected(f"no variation is called {quoted(missing[0], 120)}; {hint}")
    return [one for one in scenarios if not names or one.variation in names]


@dataclass(frozen=True)
class Checks:
    """Validation of files; with `fast`, without checks that need geometry.

    Pictures of scenarios with geometric problems are written to the folder `pictures`. An external stack without a
    command is an error if `runs`, otherwise a warning.
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
        """The stacks to check each scenario with; None = the scenario's own."""
        return self.stacks.chosen or (None,)

    def scenario(
        self, file: Path, choice: StackChoice | None = None, numbers: Sequence[int] | None = None
    ) -> tuple[Sequence[LoadedScenario], list[Problem]]:
        """Return the variations of a scenario, or none if one of them is unusable, and the problems.

        `numbers` selects variations by their numbers.
        """
        loaded = try_variations(file, self.root, self.world_path, choice, numbers)
        if isinstance(loaded, list):
            return (), loaded
        checked = [self.variation(one) for one in loaded]
        problems = merge_problems(
            [
                VariationProblems(one.variation, one.set_by, found)
                for one, (_, found) in zip(loaded, checked, strict=True)
            ]
        )
        usable = [one for one, _ in checked if one is not None]
        return (usable if len(usable) == len(checked) else ()), problems

    def variation(self, loaded: LoadedScenario) -> tuple[LoadedScenario | None, list[Problem]]:
        """Return a loaded variation with all its checks passed, or None, and the problems."""
        loaded, undefined = self.stacks.with_command(loaded.with_changes(lenient=self.lenient))
        if undefined and self.runs:
            return None, [*loaded.notes, *undefined]
        with collect_read_files() as read:
            problems = [*loaded.notes, *([] if self.fast else world_problems(loaded, self.cache, self.pictures))]
        problems += [replace(problem, severity="warning") for problem in undefined]
        loaded = loaded.with_changes(read_files=tuple(sorted(read)))
        usable = not any(problem.severity == "error" for problem in problems)
        return (loaded if usable else None), list(dict.fromkeys(problems))

    def world(self, file: Path) -> list[Problem]:
        """Return the problems that are found by building a world."""
        try:
            source = load_world_file(file, self.root, self.world_path)
            notes = list(source.map.notes) if source.map else []
            if self.fast:
                return notes
            world = world_from_file(source, self.root, self.world_path, self.lenient)
            return [*notes, *check_built_world(world, source), *world_reader_notes(world, source, self.root)]
        except InvalidInput as error:
            return error.problems

    def robot(self, file: Path) -> list[Problem]:
        """Return the problems that are found by building a robot."""
        if self.fast:
            return []
        try:
            return robot_problems(load_robot_file(str(file), self.root, self.world_path))
        except InvalidInput as error:
            return error.problems


def world_problems(
    scenario: LoadedScenario, cache: WorldCache | None = None, pictures: Path | None = None
) -> list[Problem]:
    """Return the problems that are found by building the world of a scenario."""
    try:
        return check_in_world(scenario, cache, pictures)
    except InvalidInput as error:
        return error.problems
