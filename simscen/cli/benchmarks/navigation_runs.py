"""Runs the experiments of `simscen bench nav`, through the same door as every other run."""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simscen.bench.localization.trial import anees, bounds, nees_at
from simscen.bench.navigation.experiments import Drive, Experiment
from simscen.bench.navigation.summary import Row, Trial, mean, summarize
from simscen.cli.benchmarks.results import print_progress
from simscen.cli.diagnostics import print_text
from simscen.cli.interrupts import signals_interrupt
from simscen.cli.session.pending_runs import begin
from simscen.cli.session.run_session import WARM_PROCESS
from simscen.cli.session.selection import checked
from simscen.core.errors import Exit, InvalidInput
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionEvent
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader.read import read_log
from simscen.report.journal import Journal
from simscen.report.journal_reader import UNDECIDED_KINDS
from simscen.report.session_lines import RunNaming, run_lines
from simscen.report.styled_line import plain_text
from simscen.run.process.jobs import Job
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.run_session import SessionOptions, run_session

PATIENCE = 1800.0
"""Seconds of wall time that a run may take: a busy machine is no failure of the stack."""
MOMENTS = (5.0, 10.0, 20.0, 30.0)
"""Seconds of a run at which ANEES is averaged over the runs."""


@dataclass(frozen=True)
class Localized:
    """How well the robot knew where it was: root mean square errors in m (mean and worst over runs), ANEES at MOMENTS.

    `bounds` are those of ANEES with 95 % probability when the belief is consistent.
    """

    rmse: float | None
    worst_rmse: float | None
    anees: dict[float, float]
    bounds: tuple[float, float]


@dataclass(frozen=True)
class Measured:
    """One experiment's line."""

    tally: Row
    localized: Localized | None = None


def drive(experiments: Sequence[Experiment], journal: Journal, workers: int) -> tuple[list[list[Trial]], Exit | None]:
    """Do all runs of each experiment that the journal has no verdict on, and tell of progress and of what went wrong on
    stderr.

    Returns all runs of each, and the exit code of an interrupt where there was one. Raises InvalidInput.
    """
    jobs, owners = _planned(experiments, journal.folder)
    work = begin(journal, jobs, workers)
    progress = _Progress(len(jobs), len(work.kept), {job.key: job for job in jobs})

    def listen(event: SessionEvent) -> None:
        journal(event)
        progress(event)

    with signals_interrupt():
        answers, stopped = run_session(
            work.jobs, SessionOptions(workers=workers, wall_limit=PATIENCE), WARM_PROCESS, listen
        )
    print_progress("")
    of = {answer.key: answer for answer in (*work.kept, *answers)}
    trials: list[list[Trial]] = [[] for _ in experiments]
    for job in jobs:
        number, drive = owners[job.key]
        world, speed = drive.world or str(drive.file), _top_speed(job.scenario)
        trials[number].append(Trial(of[job.key], drive.reference_length, world, speed))
    return trials, stopped


def driven(trials: Sequence[Trial]) -> list[Trial]:
    """Those that no interrupt has kept from being driven to their end."""
    return [trial for trial in trials if not _undecided(trial.run)]


def _undecided(run: RunFinished) -> bool:
    return run.result.error is not None and run.result.error.kind in UNDECIDED_KINDS


Owner = tuple[int, Drive]


def _planned(experiments: Sequence[Experiment], out: Path) -> tuple[list[Job], dict[RunKey, Owner]]:
    """A job for each run, and the experiment and the drive that it belongs to. Raises ValueError for two of one key.

    One scenario of each experiment is checked as `simscen validate` does: the others are made as it is, and whether the
    goal can be reached has been looked at when it was drawn, which takes as long as half a run.
    """
    jobs: list[Job] = []
    owners: dict[RunKey, Owner] = {}
    for number, experiment in enumerate(experiments):
        for which, planned in enumerate(experiment.drives):
            scenario = load_scenario(planned.file, experiment.root, experiment.world_path)
            found = checked(scenario) if which == 0 else []
            if problems := [problem for problem in found if problem.severity == "error"]:
                raise InvalidInput(problems)
            for seed in planned.seeds:
                key = RunKey(scenario.id, seed)
                if key in owners:
                    raise ValueError(f"two runs are called {key.scenario}, seed {seed}")
                jobs.append(Job(len(jobs), scenario, key, run_folder(out, key), PATIENCE))
                owners[key] = number, planned
    return jobs, owners


def _top_speed(scenario: LoadedScenario) -> float | None:
    """Of the fastest of its robots; None where one is none of ours."""
    robots = [view.robot.spec for view in scenario.each.values()]
    return max(robot.top_speed for robot in robots if robot) if all(robots) else None


def repeat_command(job: Job) -> str:
    """The command that repeats a run."""
    scenario = job.scenario
    folders = [part for folder in scenario.world_path for part in ("--world-path", str(folder))]
    root = ["--root", str(scenario.root)]
    return shlex.join(["simscen", "run", str(scenario.file), "--seed", str(job.key.seed), *root, *folders])


class _Progress:
    """A counter on a terminal; each run that was not passed in full."""

    def __init__(self, total: int, done: int, jobs: dict[RunKey, Job]) -> None:
        self._total, self._jobs, self._done = total, jobs, done

    def __call__(self, event: SessionEvent) -> None:
        """Take one event of the session."""
        if not isinstance(event, RunFinished) or _undecided(event):
            return
        self._done += 1
        if event.outcome is not Outcome.PASSED:
            print_progress("")
            told = replace(event, again=repeat_command(self._jobs[event.key]))
            print_text("\n".join(plain_text(line) for line in run_lines(told, RunNaming(every_seed=True))), sys.stderr)
        print_progress(f"{self._done} of {self._total} runs" if self._done < self._total else "")


def measured(experiment: Experiment, trials: list[Trial]) -> Measured:
    """The line of an experiment whose runs these are."""
    row = summarize(experiment.name, trials)
    return Measured(row, _localized(trials) if experiment.localization else None)


def _localized(trials: list[Trial]) -> Localized:
    errors = [value for trial in trials if (value := trial.metric("ape_trans_rmse")) is not None]
    traces = [read_log(Path(trial.run.artifacts.mcap)).trace for trial in trials if trial.run.artifacts.mcap]
    at = {seconds: [v for trace in traces if (v := nees_at(trace, seconds)) is not None] for seconds in MOMENTS}
    return Localized(
        rmse=mean(errors),
        worst_rmse=max(errors, default=None),
        anees={seconds: anees(values) for seconds, values in at.items() if values},
        bounds=bounds(max(1, len(traces))),
    )
