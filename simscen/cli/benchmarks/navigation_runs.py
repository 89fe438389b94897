"""Execution of the experiments of `simscen bench nav`, and summary of their results."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.bench.localization.consistency import anees_bounds, nees_at
from simscen.bench.navigation.experiments import Drive, Experiment
from simscen.bench.navigation.summary import ExperimentSummary, Trial, mean, summarize
from simscen.cli.benchmarks.results import print_progress
from simscen.cli.diagnostics import paths_from_working_folder, print_text
from simscen.cli.session.backends import backend_of, interrupt_on_signals
from simscen.cli.session.pending_runs import plan_session
from simscen.core.errors import Exit, InvalidInput
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionEvent, broadcast
from simscen.loading.checks.scene_runner import world_problems
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader import read_log
from simscen.report.display_text import plain_text
from simscen.report.journal import Journal
from simscen.report.session_lines import RunNaming, run_lines
from simscen.run.kept_files import OutcomeFilter
from simscen.run.process.jobs import Job
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.run_session import SessionOptions, run_session

WALL_LIMIT_S = 1800.0
"""Wall-clock limit of a run."""
ANEES_TIMES_S = (5.0, 10.0, 20.0, 30.0)
"""Simulated times at which the NEES is averaged over all runs."""


@dataclass(frozen=True)
class LocalizationAccuracy:
    """Accuracy of the localization in an experiment. The names of the fields are keys of the JSON output.

    rmse:        mean over the runs of the root mean square position error in m; None without values
    worst_rmse:  maximum over the runs of the root mean square position error in m; None without values
    anees:       average NEES at each of ANEES_TIMES_S, by time in s, over the runs that have not ended by then
    bounds:      95 % interval of each value of `anees` for a consistent localizer, by time in s
    """

    rmse: float | None
    worst_rmse: float | None
    anees: dict[float, float]
    bounds: dict[float, tuple[float, float]]


@dataclass(frozen=True)
class ExperimentResult:
    """Result of one experiment. The names of the fields are keys of the JSON output.

    `tally` is the summary of its runs. `localized` is the accuracy of the localization; None if it was not measured.
    """

    tally: ExperimentSummary
    localized: LocalizationAccuracy | None = None


def execute_experiments(
    experiments: Sequence[Experiment], journal: Journal, workers: int
) -> tuple[list[list[Trial]], Exit | None]:
    """Execute all runs that have no reusable result in the journal, and print progress and failures to stderr.

    Return the trials (runs with their results) of each experiment. Also return the exit code of the signal that
    interrupted the runs; None without a signal. Raises InvalidInput.
    """
    jobs, drives = _plan_jobs(experiments, journal.folder)
    pending = plan_session(journal, jobs, workers)
    progress = _Progress(len(jobs), len(pending.reused_results))
    options = SessionOptions(workers=workers, wall_limit=WALL_LIMIT_S)
    with interrupt_on_signals(), backend_of(options) as backend:
        finished_runs, stopped = run_session(pending.jobs, options, backend, broadcast(journal, progress))
    print_progress("")
    results = {finished.key: finished for finished in (*pending.reused_results, *finished_runs)}
    trials: list[list[Trial]] = [[] for _ in experiments]
    for job in jobs:
        number, drive = drives[job.key]
        world, speed = drive.world or str(drive.file), _top_speed(job.scenario)
        trials[number].append(Trial(results[job.key], drive.reference_length, world, speed))
    return trials, stopped


def finished_trials(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials, without runs that were interrupted or not started."""
    return [trial for trial in trials if not trial.run.result.is_unfinished]


def _plan_jobs(experiments: Sequence[Experiment], out: Path) -> tuple[list[Job], dict[RunKey, tuple[int, Drive]]]:
    """Return a job for each run, and the index of the experiment and the drive of each run.

    Only the first scenario of each experiment is checked in its world. Raises InvalidInput, and ValueError for two runs
    with the same key.
    """
    jobs: list[Job] = []
    drives: dict[RunKey, tuple[int, Drive]] = {}
    for number, experiment in enumerate(experiments):
        for index, drive in enumerate(experiment.drives):
            with paths_from_working_folder(experiment.root):
                scenario = load_scenario(drive.file, experiment.root, experiment.world_path)
                found = world_problems(scenario) if index == 0 else []
                if problems := [problem for problem in found if problem.severity == "error"]:
                    raise InvalidInput(problems)
            for seed in drive.seeds:
                key = RunKey(scenario.id, seed)
                if key in drives:
                    raise ValueError(f"several runs of {key.scenario} with seed {seed}")
                folder = run_folder(out, key)
                jobs.append(Job(len(jobs), scenario, key, folder, WALL_LIMIT_S, picture=OutcomeFilter.FAILED))
                drives[key] = number, drive
    return jobs, drives


def _top_speed(scenario: LoadedScenario) -> float | None:
    """Return the speed in m/s of the fastest robot; None if a robot has no robot file."""
    robots = [view.robot.spec for view in scenario.robot_views.values()]
    return max(robot.top_speed for robot in robots if robot) if all(robots) else None


class _Progress:
    """Listener that prints the number of finished runs, and all runs that did not pass, to stderr."""

    def __init__(self, total: int, finished_count: int) -> None:
        self._total, self._finished_count = total, finished_count

    def __call__(self, event: SessionEvent) -> None:
        """Handle an event of the session."""
        if not isinstance(event, RunFinished) or event.result.is_unfinished:
            return
        self._finished_count += 1
        if event.outcome is not Outcome.PASSED:
            print_progress("")
            print_text("\n".join(map(plain_text, run_lines(event, RunNaming(has_seeds=True)))), sys.stderr)
        is_running = self._finished_count < self._total
        print_progress(f"{self._finished_count} of {self._total} runs" if is_running else "")


def summarize_experiment(experiment: Experiment, trials: list[Trial]) -> ExperimentResult:
    """Return the result of an experiment from its trials."""
    row = summarize(experiment.name, trials)
    return ExperimentResult(row, _localization_accuracy(trials) if experiment.measures_localization else None)


def _localization_accuracy(trials: list[Trial]) -> LocalizationAccuracy:
    errors = [value for trial in trials if (value := trial.metric("ape_trans_rmse")) is not None]
    traces = [read_log(Path(trial.run.artifacts.mcap)).trace for trial in trials if trial.run.artifacts.mcap]
    samples = {
        seconds: [v for trace in traces if (v := nees_at(trace, seconds)) is not None] for seconds in ANEES_TIMES_S
    }
    known = {seconds: values for seconds, values in samples.items() if values}
    return LocalizationAccuracy(
        rmse=mean(errors),
        worst_rmse=max(errors, default=None),
        anees={seconds: sum(values) / len(values) for seconds, values in known.items()},
        bounds={seconds: anees_bounds(len(values)) for seconds, values in known.items()},
    )
