"""A session: many runs, each answered exactly once, told to whoever listens."""

import filecmp
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from simscen.core.errors import Exit, UsageError
from simscen.core.random_streams import LARGEST_SEED
from simscen.core.records.run_result import Outcome, RunFailure, RunKey
from simscen.core.records.session_events import Listener, RunFinished, RunProgress, RunStarted
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.run.process.jobs import Job, ReplayMode
from simscen.run.process.plugin_path import plugin_path_arguments
from simscen.run.process.supervisor import Ended, Interrupted, Progressed, Started, supervise
from simscen.run.reproducibility.comparison import compare_with_session
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.results import finished_run, skipped_run, unfinished_run


@dataclass(frozen=True)
class SessionOptions:
    """How to run. `seed` None = each scenario's own; `repeat` runs use consecutive seeds.

    `twice` runs everything a second time with the same seed, to compare; `against` is the output folder of an earlier
    session to compare with. `wall_limit` in seconds bounds each run. `only` are the keys of all that is to be run, with
    their seeds; None = everything. `replay` says which runs get a page that plays them.
    """

    workers: int = 1
    seed: int | None = None
    repeat: int = 1
    twice: bool = False
    fail_fast: bool = False
    wall_limit: float = 300.0
    against: Path | None = None
    replay: ReplayMode = ReplayMode.NONE
    only: frozenset[RunKey] | None = None


def scenario_seeds(scenario: LoadedScenario, options: SessionOptions) -> range:
    """The seeds that a scenario is run with. Raises UsageError when they lead beyond the largest there is."""
    first = options.seed if options.seed is not None else scenario.spec.seed
    if first + options.repeat - 1 > LARGEST_SEED:
        told = f"{options.repeat} runs of {scenario.title} from seed {first} on"
        raise UsageError(f"{told} would need seeds beyond the largest, {LARGEST_SEED}")
    return range(first, first + options.repeat)


def plan_jobs(scenarios: Sequence[LoadedScenario], options: SessionOptions, out: Path) -> list[Job]:
    """All runs of a session in the order they are started: variation by variation, seed by seed, stack by stack."""
    jobs: list[Job] = []
    skipped = [scenario for scenario in scenarios if scenario.spec.skip is not None]
    scenarios = [scenario for scenario in scenarios if scenario.spec.skip is None]
    for title, group in groupby(scenarios, key=lambda scenario: scenario.title):
        variants = list(group)
        for seed in _seeds(title, variants[0], options):
            for scenario in variants:
                key = scenario.key(seed)
                if options.only is not None and key not in options.only:
                    continue
                for each in (key, key.twin) if options.twice else (key,):
                    jobs.append(
                        Job(len(jobs), scenario, each, run_folder(out, each), options.wall_limit, options.replay)
                    )
    # Once each, whatever the number of seeds, and behind the others: twins are told by their numbers.
    for scenario in skipped if options.only is None else ():
        key = scenario.key(scenario_seeds(scenario, options)[0])
        jobs.append(Job(len(jobs), scenario, key, run_folder(out, key), options.wall_limit))
    return jobs


def _seeds(title: str, scenario: LoadedScenario, options: SessionOptions) -> Sequence[int]:
    """The seeds to run a scenario with, those of `only` where that is given."""
    if options.only is None:
        return scenario_seeds(scenario, options)
    return sorted({key.seed for key in options.only if key.test == title})


def run_session(
    jobs: Sequence[Job], options: SessionOptions, entry: Sequence[str], listen: Listener
) -> tuple[list[RunFinished], Exit | None]:
    """Do all jobs; every one of them is answered, in the order they finish, whatever happens.

    Returns the answers and, when the session was interrupted, the exit code that says so.
    """
    answers: dict[int, RunFinished] = {}
    begun: set[int] = set()
    stopped: Exit | None = None

    def go_on() -> bool:
        return not options.fail_fast or all(answer.outcome.good for answer in answers.values())

    for job in jobs:
        if job.scenario.spec.skip is not None:
            answers[job.number] = skipped_run(job, job.scenario.spec.skip)
            listen(answers[job.number])
    jobs_to_do = [job for job in jobs if job.number not in answers]
    try:
        told = plugin_path_arguments(plugins_of_all([job.scenario for job in jobs_to_do]))
        for happening in supervise(jobs_to_do, options.workers, (*entry, *told), go_on):
            job = happening.job
            match happening:
                case Started():
                    begun.add(job.number)
                    listen(RunStarted(job.key, job.scenario.path, job.scenario.spec.time_limit))
                case Progressed(seconds=seconds):
                    listen(RunProgress(job.key, seconds))
                case Ended(end=end):
                    twin = answers.get(job.number ^ 1) if options.twice else None
                    answer = compare_twins(finished_run(job, end), twin)
                    answers[job.number] = (
                        answer if options.against is None else compare_with_session(answer, options.against)
                    )
                    listen(answers[job.number])
    except Interrupted as interrupted:
        stopped = Exit(128 + interrupted.number)
    for job in jobs:
        if job.number not in answers:
            answers[job.number] = unfinished_run(job, _why_not_done(job.number in begun, stopped))
            listen(answers[job.number])
    return list(answers.values()), stopped


def compare_twins(run: RunFinished, twin: RunFinished | None) -> RunFinished:
    """The answer to the later of two runs that should be equal: an error that names where their logs part."""
    if twin is None or not run.artifacts.mcap or not twin.artifacts.mcap:
        return run
    if filecmp.cmp(run.artifacts.mcap, twin.artifacts.mcap, shallow=False):
        return run
    from simscen.record.difference import first_difference
    from simscen.record.replay import read_log

    logs = [read_log(Path(path)) for path in (twin.artifacts.mcap, run.artifacts.mcap)]
    pairs = zip(*(log.traces for log in logs), strict=False)
    where = (
        next((told for pair in pairs if (told := first_difference(*pair))), "")
        or "the logs differ in something that is not part of the trace"
    )
    failure = RunFailure("nondeterministic", f"two runs with the same seed differ: {where}")
    return replace(run, result=replace(run.result, outcome=Outcome.ERROR, error=failure))


def _why_not_done(begun: bool, stopped: Exit | None) -> RunFailure:
    if begun:
        return RunFailure("interrupted", "interrupted before it was finished")
    return RunFailure("not-run", "interrupted" if stopped else "another run did not pass (--fail-fast)")
