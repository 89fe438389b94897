"""What a session has to do: all of its runs, or those that an earlier one in the same folder left."""

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simscen.core.errors import InvalidInput, UsageError
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionStarted, session_started
from simscen.core.version import __version__
from simscen.judge.result_json import result_data
from simscen.loading.loaded import LoadedScenario
from simscen.report.journal import Journal
from simscen.report.journal_reader import PlannedRun, last_failed, read_journal
from simscen.run.process.jobs import Job
from simscen.run.reproducibility.digest import scenario_digest
from simscen.run.sessions.output_folder import DEFAULT_FOLDER
from simscen.run.sessions.results import repeat_command, shown
from simscen.run.sessions.run_session import SessionOptions, scenario_seeds

SAME_IN_LOG = ("scenario", "seed", "variation", "stack_name", "simulated_seconds", "verdicts")
"""Keys of result.json that a log and the journal hold alike."""


@dataclass(frozen=True)
class PendingRuns:
    """The journal of the session, the jobs to do, and the answers that are `kept` from the session before.

    `stacks` are the NAME=VALUE of those that were chosen.
    """

    journal: Journal
    jobs: Sequence[Job]
    kept: Sequence[RunFinished]
    workers: int
    stacks: tuple[str, ...] = ()

    def started(self, folder: Path) -> SessionStarted:
        """The first event of the session."""
        keys = [*(job.key for job in self.jobs), *(answer.key for answer in self.kept)]
        return session_started(__version__, keys, self.workers, folder, self.stacks)


def begin(journal: Journal, jobs: Sequence[Job], workers: int) -> PendingRuns:
    """Plan the session in its journal. Raises UsageError when not even that can be written.

    Kept are verdicts, not errors, on scenarios that are as they were; of two runs that are to be compared, both or
    none.
    """
    scenarios = {_asked(job): job.scenario for job in jobs}
    digests = {asked: scenario_digest(scenario) for asked, scenario in scenarios.items()}
    planned = [_planned(job, digests[_asked(job)]) for job in jobs]
    known = _verdicts(journal)
    answers = [known.get(run) for run in planned]
    kept: list[RunFinished] = []
    left: list[Job] = []
    for number, (job, answer) in enumerate(zip(jobs, answers, strict=True)):
        if answer is not None and answers[_twin(jobs, number)] is not None:
            kept.append(replace(answer, resumed=True))
        else:
            left.append(job)
    journal.plan(planned, __version__, workers)
    for answer in kept:
        journal(answer)
    if journal.error:
        raise UsageError(f"cannot write the journal in {journal.folder}: {journal.error.strerror}")
    return PendingRuns(journal, left, kept, workers, tuple(dict.fromkeys(run.stack for run in planned if run.stack)))


def _planned(job: Job, scenario_digest: str) -> PlannedRun:
    scenario = job.scenario
    again = repeat_command(scenario, job.key.seed)
    return PlannedRun(job.key, scenario.path, scenario_digest, again, shown(scenario.file), scenario.stack)


def _verdicts(journal: Journal) -> dict[PlannedRun, RunFinished]:
    """The verdicts that the folder holds already, by what was asked; only those whose logs are still theirs."""
    try:
        past = read_journal(journal.folder)
    except InvalidInput:  # a new folder
        return {}
    answers = {run: past.answered[run.key] for run in past.planned if run.key in past.answered}
    return {run: answer for run, answer in answers.items() if answer.outcome is not Outcome.ERROR and _has_log(answer)}


def _has_log(answer: RunFinished) -> bool:
    """Return whether the log of a run is still there and holds the same verdicts; True if none was written."""
    if not answer.artifacts.mcap:
        return True
    from simscen.record.log_file import attached_result  # only a resumed session needs the library

    recorded = attached_result(Path(answer.artifacts.mcap))
    expected = json.loads(json.dumps(result_data(answer.result)))
    expected["stack_name"] = answer.key.first.stack_name
    return recorded is not None and all(recorded.get(key) == expected[key] for key in SAME_IN_LOG)


def _twin(jobs: Sequence[Job], number: int) -> int:
    """The number of the run that is to be compared with this one (--check-determinism); its own when there is none."""
    twin = number ^ 1
    if twin < len(jobs) and jobs[twin].key != jobs[number].key and jobs[twin].key.first == jobs[number].key.first:
        return twin
    return number


def _asked(job: Job) -> tuple[str, str, str]:
    """Scenario, variation and stack."""
    return job.scenario.id, job.scenario.variation, job.scenario.stack_name


EVERYTHING = "everything that is chosen runs"


def failed_runs(
    scenarios: Sequence[LoadedScenario], options: SessionOptions, out: Path | None
) -> tuple[frozenset[RunKey] | None, str]:
    """The runs of these scenarios that failed when they were run last, and what to tell.

    None where there is nothing to choose by: then, as with pytest, everything runs. Sessions are looked for beside the
    output folder `out`. A failed run keeps its seed, unless the options name seeds.
    """
    home = DEFAULT_FOLDER if out is None else out.absolute().parent
    last = last_failed(home)
    if last is None:
        return None, f"there is no earlier session in {home}: {EVERYTHING}"
    if not last.runs:
        return None, f"nothing failed in the last session, {last.folder}: {EVERYTHING}"
    chosen = {(one.title, one.stack_name): one for one in scenarios if one.spec.skip is None}
    found = frozenset(key for key in last.runs if _run_key(key, chosen.get((key.test, key.stack_name)), options))
    left = len(last.runs) - len(found)
    where = f"{left} {_is(left)} not among what is chosen"
    if not found:
        return None, f"{_runs(last.runs)} failed last, and {_is(left)} not among what is chosen: {EVERYTHING}"
    return found, f"{_runs(last.runs)} failed last" + (f": {len(found)} {_is(len(found))} run, {where}" if left else "")


def _run_key(key: RunKey, scenario: LoadedScenario | None, options: SessionOptions) -> bool:
    if scenario is None:
        return False
    return (options.seed is None and options.repeat == 1) or key.seed in scenario_seeds(scenario, options)


def _runs(runs: Collection[RunKey]) -> str:
    return f"{len(runs)} run{'' if len(runs) == 1 else 's'}"


def _is(number: int) -> str:
    return "is" if number == 1 else "are"
