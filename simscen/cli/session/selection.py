"""Selection of scenarios by the options of a session, such as tags and shards (parts for parallel CI jobs)."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from statistics import median
from typing import NamedTuple

from simscen.cli.diagnostics import escaped, relative_to_working_folder
from simscen.cli.session.file_checks import FileChecker
from simscen.cli.session.stacks import parse_stacks
from simscen.core.errors import InvalidInput, NothingSelected, Problem, UsageError
from simscen.loading.codes import UNSUPPORTED_BY_STACK
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.files.paths import absolute_path, is_folder
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.variations.naming import number_of


class _ParallelJob(NamedTuple):
    """Environment variables of a CI system that number parallel jobs.

    index_variable:  variable with the number of this job
    count_variable:  variable with the count of jobs
    first_variable:  variable with the number of the first job; "" without such a variable
    first:           number of the first job if `first_variable` is ""
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
"""Variables of GitLab, CircleCI, Buildkite, Slurm, and Kubernetes, in the order in which they are searched."""


def parse_shard(text: str, environ: Mapping[str, str]) -> tuple[int, int]:
    """Return the number of this shard and the count of shards from the value of --shard, such as "2/4".

    The value "auto" stands for the variables of the CI system in `environ`. Raises UsageError.
    """
    text = _parallel_job(environ) if text == "auto" else text
    number, slash, count = text.partition("/")
    if slash and text.isascii() and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count):
        return int(number), int(count)
    raise UsageError(f"cannot read --shard {escaped(text)}: expected i/n with 1 <= i <= n, e.g. 2/4")


def _parallel_job(environ: Mapping[str, str]) -> str:
    """Return number and count of this job, such as "2/4", from the variables of a CI system. Raises UsageError."""
    for job in PARALLEL_JOBS:
        index, count = environ.get(job.index_variable, ""), environ.get(job.count_variable, "")
        first = environ.get(job.first_variable, str(job.first))
        if index.isdecimal() and count.isdecimal() and first.isdecimal():
            return f"{int(index) - int(first) + 1}/{count}"
    known = ", ".join(f"{job.index_variable} and {job.count_variable}" for job in PARALLEL_JOBS)
    raise UsageError(
        f"--shard auto: no CI system has set the variables of its parallel jobs ({known}); use --shard i/n"
    )


def scenarios_of_shard(
    scenarios: list[LoadedScenario], number: int, count: int, times: Mapping[str, float]
) -> list[LoadedScenario]:
    """Return the scenarios of shard `number` of `count`, in their order. Raises NothingSelected for an empty shard.

    `times` are durations of scenarios in s by title. The scenarios are assigned from the longest to the shortest, each
    to the shard with the least total time so far. A missing duration counts as the median. If `times` is empty, a shard
    has every `count`-th scenario.
    """
    if times and count > 1:
        default = median(times.values())
        seconds = [times.get(scenario.title, default) for scenario in scenarios]
        work, shards = [0.0] * count, [0] * len(scenarios)
        for index in sorted(range(len(scenarios)), key=lambda index: -seconds[index]):
            shards[index] = min(range(count), key=work.__getitem__)
            work[shards[index]] += seconds[index]
        selected = [scenario for index, scenario in enumerate(scenarios) if shards[index] == number - 1]
    else:
        selected = scenarios[number - 1 :: count]
    if not selected:
        raise NothingSelected(f"shard {number}/{count} of {len(scenarios)} scenarios is empty")
    return selected


def scenario_times(folders: Sequence[Path]) -> dict[str, float]:
    """Return the mean wall-clock time of each scenario's runs in s, by title of the scenario.

    `folders` are output folders of earlier sessions. Raises InvalidInput if a folder has no journal.
    """
    from simscen.report.journal_reader import read_journal  # not needed by light commands

    wall_times = defaultdict(list)
    for folder in folders:
        for run in read_journal(folder).finished.values():
            wall_times[run.key.test].append(run.wall)
    return {title: sum(times) / len(times) for title, times in wall_times.items()}


@dataclass(frozen=True)
class Selection:
    """Filter of scenarios.

    keyword:     expression about ids, as with `pytest -k`; "" selects all scenarios
    tags:        a scenario needs at least one of these tags; () selects all scenarios
    shard:       number of this shard (from 1), and count of shards
    variations:  names of variations; () selects all variations
    times:       durations of scenarios in s by title, to balance shards
    """

    keyword: str = ""
    tags: Sequence[str] = ()
    shard: tuple[int, int] = (1, 1)
    variations: Sequence[str] = ()
    times: Mapping[str, float] = field(default_factory=dict)

    @property
    def variation_numbers(self) -> list[int] | None:
        """Numbers of the selected variations if all have names such as "variation-7"; None otherwise."""
        numbers = [number for name in self.variations if (number := number_of(name)) is not None]
        return numbers if numbers and len(numbers) == len(self.variations) else None


def load_selection(
    paths: Sequence[Path],
    root: Path | None,
    world_path: Sequence[Path],
    lenient: bool,
    selection: Selection,
    stacks: Sequence[str] = (),
) -> tuple[list[LoadedScenario], list[Problem]]:
    """Return each selected scenario below `paths` with each of `stacks`, and warnings about these scenarios.

    `stacks` are values of --stack; () keeps the stack of each scenario. If a stack cannot run a scenario, the scenario
    is skipped, or invalid if `paths` contains its file. Raises InvalidInput if a file below `paths` is invalid, and
    NothingSelected if no scenario is selected.
    """
    root_folder = root or default_root(paths)
    checker = FileChecker(root_folder, world_path, lenient, stacks=parse_stacks(stacks, root_folder, world_path))
    choices = checker.choices
    loaded: dict[str, list[LoadedScenario]] = {}
    problems: dict[Problem, None] = {}
    warnings: dict[str, list[Problem]] = {}
    named_files = {absolute_path(path) for path in paths if not is_folder(path)}
    for file, choice in product(discover(paths, root_folder), choices):
        variations, found = checker.check_scenario(file, choice, selection.variation_numbers)
        if choice is not None and file not in named_files and (reason := _stack_limitation(choice, found)):
            variations, found = checker.check_scenario(file, None, selection.variation_numbers)
            variations = [variation.as_skipped(choice, reason) for variation in variations]
        for scenario in variations:
            loaded.setdefault(scenario.title, []).append(scenario.with_changes(has_several_stacks=len(choices) > 1))
            warnings.setdefault(scenario.id, []).extend(found)
        problems.update(dict.fromkeys(found))
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(relative_to_working_folder(problems, root_folder))
    unique = _select_variations([by_stack[0] for by_stack in loaded.values()], selection.variations)
    selected = scenarios_of_shard(select(unique, selection.keyword, selection.tags), *selection.shard, selection.times)
    relevant = dict.fromkeys(warning for scenario in selected for warning in warnings[scenario.id])
    scenarios = [with_stack for scenario in selected for with_stack in loaded[scenario.title]]
    return scenarios, relative_to_working_folder(relevant, root_folder)


def _stack_limitation(choice: StackChoice, problems: Sequence[Problem]) -> str:
    """Return why a stack cannot run a scenario with these problems; "" unless all errors are limits of the stack."""
    errors = [problem for problem in problems if problem.severity == "error"]
    if not errors or any(problem.code != UNSUPPORTED_BY_STACK for problem in errors):
        return ""
    first = errors[0]
    return f"--stack {choice.name} cannot run it: {first.place}: {first.message}"


def _select_variations(scenarios: list[LoadedScenario], names: Sequence[str]) -> list[LoadedScenario]:
    """Return the variations with one of these names, or all if `names` is empty.

    Raises NothingSelected for an unknown name.
    """
    known = dict.fromkeys(scenario.variation for scenario in scenarios if scenario.variation)
    if missing := [name for name in names if name not in known]:
        if number_of(missing[0]) is not None:
            raise NothingSelected(f"no scenario has a {missing[0]} that meets the conditions in `require`")
        hint = suggestion(missing[0], known) or "no scenario has variations"
        raise NothingSelected(f"no variation is called {quoted(missing[0], 120)}; {hint}")
    return [scenario for scenario in scenarios if not names or scenario.variation in names]
