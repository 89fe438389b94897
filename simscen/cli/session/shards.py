"""Division of a session over several machines: `--shard i/n` and `--shard auto`, balanced by earlier runs."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from simscen.cli.diagnostics import escaped
from simscen.core.errors import NothingSelected, UsageError
from simscen.loading.loaded import LoadedScenario


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
