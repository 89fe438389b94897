"""Run a session: plan the runs, execute them, and report exactly one result for each run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from simscen.core.errors import Exit, UsageError
from simscen.core.random_streams import MAX_SEED
from simscen.core.records.run_result import INTERRUPTED, NOT_RUN, RunFailure, RunKey
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import Listener, RunFinished, RunProgress, RunStarted
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.run.kept_files import LogRetention, OutcomeFilter
from simscen.run.process.jobs import Backend, Ended, Job, Progressed, Started
from simscen.run.process.supervisor import Interrupted
from simscen.run.sessions.log_comparison import compare_with_repetition, compare_with_session
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.results import finished_run, skipped_run, unfinished_run


@dataclass(frozen=True)
class SessionOptions:
    """Options of a session.

    Attributes:
        workers: Largest number of concurrent runs.
        seed: First of the `repeat` consecutive seeds (None: the seed of each scenario).
        check_determinism: Whether each run is repeated with the same seed and must give the same log.
        fail_fast: Whether the session ends after the first run that does not pass.
        wall_limit: Limit of the wall time of each run in s.
        check_against: Output folder of an earlier session with which each run is compared (None: no comparison).
        replay: Outcomes for which a replay page is written.
        selected_runs: Runs to execute (None: all).
        keep_logs: Runs of which all files are kept.
        cluster: Address of the Ray cluster that executes the runs ("": this machine).
    """

    workers: int = 1
    seed: int | None = None
    repeat: int = 1
    check_determinism: bool = False
    fail_fast: bool = False
    wall_limit: float = 300.0
    check_against: Path | None = None
    replay: OutcomeFilter = OutcomeFilter.NONE
    selected_runs: frozenset[RunKey] | None = None
    keep_logs: LogRetention = LogRetention.ALL
    cluster: str = ""

    def job(self, number: int, scenario: LoadedScenario, key: RunKey, out: Path) -> Job:
        """Return the job of a run. `out` is the output folder of the session."""
        picture = OutcomeFilter.FAILED if self.keep_logs is LogRetention.FAILED else OutcomeFilter.ALL
        return Job(number, scenario, key, run_folder(out, key), self.wall_limit, self.replay, picture)


def scenario_seeds(scenario: LoadedScenario, options: SessionOptions) -> range:
    """Return the seeds with which a scenario runs. Raises UsageError if a seed exceeds MAX_SEED."""
    first = options.seed if options.seed is not None else scenario.spec.seed
    if first + options.repeat - 1 > MAX_SEED:
        runs = f"{options.repeat} runs of {scenario.title} from seed {first} on"
        raise UsageError(f"{runs} need seeds above the largest seed, {MAX_SEED}")
    return range(first, first + options.repeat)


def plan_jobs(scenarios: Sequence[LoadedScenario], options: SessionOptions, out: Path) -> list[Job]:
    """Return all runs of a session, ordered by scenario, seed, variation, and stack; skipped scenarios are last.

    `out` is the output folder of the session.
    """
    jobs: list[Job] = []
    skipped = [scenario for scenario in scenarios if scenario.spec.skip is not None]
    scenarios = [scenario for scenario in scenarios if scenario.spec.skip is None]
    for title, group in groupby(scenarios, key=lambda scenario: scenario.title):
        variants = list(group)
        for seed in _seeds(title, variants[0], options):
            for scenario in variants:
                key = scenario.key(seed)
                if options.selected_runs is not None and key not in options.selected_runs:
                    continue
                for run_key in (key, key.repetition) if options.check_determinism else (key,):
                    jobs.append(options.job(len(jobs), scenario, run_key, out))
    # Skipped scenarios come last, because the numbers of a run and its repetition must differ only in the last bit.
    for scenario in skipped if options.selected_runs is None else ():
        key = scenario.key(scenario_seeds(scenario, options)[0])
        jobs.append(options.job(len(jobs), scenario, key, out))
    return jobs


def _seeds(title: str, scenario: LoadedScenario, options: SessionOptions) -> Sequence[int]:
    """Return the seeds of a scenario, or only the seeds in `options.selected_runs`."""
    if options.selected_runs is None:
        return scenario_seeds(scenario, options)
    return sorted({key.seed for key in options.selected_runs if key.test == title})


def run_session(
    jobs: Sequence[Job], options: SessionOptions, backend: Backend, listener: Listener
) -> tuple[RunStore, Exit | None]:
    """Run all jobs, and pass the events of the session to `listener`: exactly one result for each job, and progress.

    Returns the results, and the exit code if the session was interrupted, else None.
    """
    results, positions = RunStore(), dict[int, int]()
    started: set[int] = set()
    stopped: Exit | None = None
    all_good = True

    def report(job: Job, run: RunFinished) -> None:
        nonlocal all_good
        all_good = all_good and run.outcome.is_good
        positions[job.number] = len(results)
        results.append(run)
        listener(run)

    for job in jobs:
        if job.scenario.spec.skip is not None:
            report(job, skipped_run(job, job.scenario.spec.skip))
    pending = {job.number: job for job in jobs if job.number not in positions}
    try:
        plugins = plugins_of_all([job.scenario for job in pending.values()])
        for update in backend.run(pending.values(), plugins, lambda: all_good or not options.fail_fast):
            job = pending[update.number]
            match update:
                case Started():
                    started.add(job.number)
                    listener(RunStarted(job.key, job.scenario.path, job.scenario.spec.time_limit))
                case Progressed(seconds=seconds):
                    listener(RunProgress(job.key, seconds))
                case Ended(end=end):
                    other_number = job.number ^ 1  # the repetition of this run, or the run that it repeats
                    is_other_finished = options.check_determinism and other_number in positions
                    other = results[positions[other_number]] if is_other_finished else None
                    run = compare_with_repetition(finished_run(job, end), other)
                    if options.check_against is not None:
                        run = compare_with_session(run, options.check_against)
                    if options.keep_logs is LogRetention.FAILED and run.outcome.is_good:
                        run = delete_all_but_result(run)
                    report(job, run)
    except Interrupted as interrupted:
        stopped = Exit(128 + interrupted.number)
    for job in jobs:
        if job.number not in positions:
            report(job, unfinished_run(job, _unfinished_reason(job.number in started, stopped)))
    return results, stopped


def delete_all_but_result(run: RunFinished) -> RunFinished:
    """Delete all files of a run except its result.json; return the run without paths of deleted files."""
    result = Path(run.artifacts.result)
    for file in Path(run.artifacts.folder).iterdir():
        if file.is_file() and file != result:
            file.unlink()
    return replace(run, artifacts=replace(run.artifacts, mcap="", picture="", replay=""))


def _unfinished_reason(was_started: bool, stopped: Exit | None) -> RunFailure:
    """Return why a run has no result. `stopped` is the exit code of an interrupted session, else None."""
    if was_started:
        return RunFailure(INTERRUPTED, "interrupted before it was finished")
    return RunFailure(NOT_RUN, "interrupted" if stopped else "another run did not pass (--fail-fast)")
