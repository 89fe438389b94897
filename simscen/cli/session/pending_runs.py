"""Division of the planned runs of a session into runs to execute, and runs with reusable earlier results."""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.core.errors import InvalidInput, UsageError
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionStarted, session_started
from simscen.core.version import __version__
from simscen.judge.result_json import result_data
from simscen.loading.loaded import LoadedScenario
from simscen.report.display_text import number_with_noun
from simscen.report.journal import Journal
from simscen.report.journal_reader import JournaledSession, PlannedRun, read_journal
from simscen.report.session_history import last_failed
from simscen.report.violations import short_run_name
from simscen.run.process.jobs import Job
from simscen.run.reproducibility import ScenarioDigests, scenario_digests
from simscen.run.sessions.output_folder import DEFAULT_FOLDER
from simscen.run.sessions.results import display_path, repeat_command
from simscen.run.sessions.run_session import SessionOptions, scenario_seeds

SHARED_RESULT_KEYS = ("scenario", "seed", "variation", "stack_name", "simulated_seconds", "verdicts")
"""Keys of a result that are compared between journal and log, to detect a log of another run."""


@dataclass(frozen=True)
class PendingRuns:
    """Planned runs of a session: runs to execute, and runs with reused results.

    journal:         journal of the session, a file that lists planned and finished runs
    jobs:            runs to execute
    reused_results:  results of the other runs, from an earlier session in the same folder
    workers:         number of parallel runs
    stacks:          values NAME=VALUE of --stack
    """

    journal: Journal
    jobs: Sequence[Job]
    reused_results: Sequence[RunFinished]
    workers: int
    stacks: tuple[str, ...] = ()

    def start_event(self, folder: Path) -> SessionStarted:
        """Return the first event of the session. `folder` is the output folder."""
        keys = [*(job.key for job in self.jobs), *(run.key for run in self.reused_results)]
        return session_started(__version__, keys, self.workers, folder, self.stacks)


def plan_session(journal: Journal, jobs: Sequence[Job], workers: int, shard: tuple[int, int] = (1, 1)) -> PendingRuns:
    """Write the planned runs to the journal, and return the pending runs.

    A result of an earlier session in the folder is reused if it is not an error and its scenario has not changed.
    `shard` is the number of this shard (from 1) and the count of shards. Raises UsageError if the journal cannot be
    written.
    """
    planned = plan_runs(jobs)
    past = previous_session(journal)
    warn_of_dropped_runs(journal.folder, past, planned)
    remaining, reused = divide_runs(jobs, planned, reusable_results(past))
    journal.plan(planned, __version__, workers, shard)
    write_reused(journal, reused)
    return PendingRuns(
        journal, remaining, reused, workers, tuple(dict.fromkeys(run.stack for run in planned if run.stack))
    )


def plan_runs(jobs: Sequence[Job]) -> list[PlannedRun]:
    """Return the runs of these jobs as entries of the journal."""
    planned = []
    digests: dict[tuple[str, str, str], ScenarioDigests] = {}
    for job in jobs:
        scenario, seed = job.scenario, job.key.seed
        identity = (scenario.id, scenario.variation, scenario.stack_name)
        if identity not in digests:
            digests[identity] = scenario_digests(scenario)
        digest, file, again = digests[identity], display_path(scenario.file), repeat_command(scenario, seed)
        run = PlannedRun(
            job.key, scenario.path, digest.run, again, file, scenario.stack, digest.definition, scenario.varied_values
        )
        planned.append(run)
    return planned


def divide_runs(
    jobs: Sequence[Job], planned: Sequence[PlannedRun], earlier_results: Mapping[PlannedRun, RunFinished]
) -> tuple[list[Job], list[RunFinished]]:
    """Return the jobs to execute, and the earlier results of all other jobs.

    `planned` are the runs of the jobs in the same order. The two runs that --check-determinism compares are either both
    executed or both reused.
    """
    results = [earlier_results.get(run) for run in planned]
    reused: list[RunFinished] = []
    remaining: list[Job] = []
    for number, (job, result) in enumerate(zip(jobs, results, strict=True)):
        if result is not None and results[_compared_index(jobs, number)] is not None:
            reused.append(replace(result, resumed=True))
        else:
            remaining.append(job)
    return remaining, reused


def write_reused(journal: Journal, reused: Sequence[RunFinished]) -> None:
    """Write reused results to the journal. Raises UsageError if the journal cannot be written."""
    for finished in reused:
        journal(finished)
    if journal.error:
        raise UsageError(f"cannot write the journal in {journal.folder}: {journal.error.strerror}")


def previous_session(journal: Journal) -> JournaledSession | None:
    """Return the earlier session in the folder of the journal; None for a new folder."""
    try:
        return read_journal(journal.folder)
    except InvalidInput:
        return None


def reusable_results(past: JournaledSession | None) -> dict[PlannedRun, RunFinished]:
    """Return the reusable results of an earlier session, by planned run.

    A result is reusable if it is not an error and equals the result in its log.
    """
    if past is None:
        return {}
    results = {run: past.finished[run.key] for run in past.planned if run.key in past.finished}
    return {
        run: finished
        for run, finished in results.items()
        if finished.outcome is not Outcome.ERROR and _has_matching_log(finished)
    }


def warn_of_dropped_runs(folder: Path, past: JournaledSession | None, planned: Sequence[PlannedRun]) -> None:
    """Print a warning if reports will omit runs of the earlier session in a folder, which are not planned again."""
    earlier = () if past is None else past.planned
    now = {run.key for run in planned}
    dropped = [run.key for run in earlier if run.key not in now]
    if dropped:
        runs = f"{number_with_noun(len(dropped), 'run')} of {len(earlier)}"
        text = f"{runs} of the session to resume, such as {short_run_name(dropped[0])}, will not be in its reports"
        print_text(f"simscen: warning: {folder}: {text}, because the selection has changed", sys.stderr)


def _has_matching_log(finished: RunFinished) -> bool:
    """Return whether the log of the run exists and contains this result; True for a run without a log."""
    if not finished.artifacts.mcap:
        return True
    from simscen.record.mcap_reader import attached_result  # only a resumed session needs the library

    recorded = attached_result(Path(finished.artifacts.mcap))
    expected = json.loads(json.dumps(result_data(finished.result)))
    expected["stack_name"] = finished.key.original.stack_name
    return recorded is not None and all(recorded.get(key) == expected[key] for key in SHARED_RESULT_KEYS)


def _compared_index(jobs: Sequence[Job], number: int) -> int:
    """Return the index of the run with which --check-determinism compares run `number`; `number` if there is none."""
    twin = number ^ 1
    if twin < len(jobs) and jobs[twin].key != jobs[number].key and jobs[twin].key.original == jobs[number].key.original:
        return twin
    return number


RUN_ALL = "all selected scenarios run"
"""End of a message of --last-failed that selects no runs, so that all selected scenarios run."""


def failed_runs(
    scenarios: Sequence[LoadedScenario], options: SessionOptions, out: Path | None
) -> tuple[frozenset[RunKey] | None, str]:
    """Return the runs of these scenarios that failed when they last ran, and a message for the user.

    The runs are None if there is no earlier session, or no such run; all scenarios run then. Sessions are searched in
    the parent folder of `out`, the output folder, or in simscen-out if `out` is None. If the options set seeds, runs
    with other seeds are ignored.
    """
    sessions_folder = DEFAULT_FOLDER if out is None else out.absolute().parent
    failed = last_failed(sessions_folder)
    if failed is None:
        return None, f"there is no earlier session in {sessions_folder}: {RUN_ALL}"
    if not failed:
        return None, f"no run in {sessions_folder} failed when it last ran: {RUN_ALL}"
    selected = {(scenario.title, scenario.stack_name): scenario for scenario in scenarios if scenario.spec.skip is None}
    any_seed = options.seed is None and options.repeat == 1
    found = frozenset(
        key
        for key in failed
        if (scenario := selected.get((key.test, key.stack_name))) is not None
        and (any_seed or key.seed in scenario_seeds(scenario, options))
    )
    missing = len(failed) - len(found)
    text = f"{number_with_noun(len(failed), 'run')} failed when last run"
    if not found:
        return None, f"{text}, but none is selected: {RUN_ALL}"
    return found, text + (f": {len(found)} selected, {missing} not" if missing else "")
