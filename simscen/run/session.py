"""A session: many runs, each answered exactly once, told to whoever listens."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import Exit
from simscen.core.session import (
    Outcome,
    RunFailure,
    RunFinished,
    RunKey,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.loading.loaded import LoadedScenario
from simscen.run.jobs import Job
from simscen.run.supervisor import Advanced, Ended, Interrupted, Started, supervise
from simscen.run.told import told

Listener = Callable[[SessionEvent], None]


@dataclass(frozen=True)
class Options:
    """How to run. `seed` None = each scenario's own; `repeat` runs use consecutive seeds.

    `twice` runs everything a second time with the same seed, to compare. `wall_limit` in seconds bounds each run.
    """

    workers: int = 1
    seed: int | None = None
    repeat: int = 1
    twice: bool = False
    fail_fast: bool = False
    wall_limit: float = 300.0


@dataclass
class _Tally:
    """What has come in so far."""

    counts: dict[Outcome, int] = field(default_factory=lambda: dict.fromkeys(Outcome, 0))
    simulated: float = 0.0

    def add(self, finished: RunFinished) -> None:
        self.counts[finished.outcome] += 1
        self.simulated += finished.simulated

    @property
    def clean(self) -> bool:
        return not self.counts[Outcome.FAILED] and not self.counts[Outcome.ERROR]


@dataclass(frozen=True)
class Run:
    """One run to do: which, of what, and the job it is given to the warm process as."""

    key: RunKey
    scenario: LoadedScenario
    job: Job


def plan(scenarios: Sequence[LoadedScenario], options: Options, out: Path) -> list[Run]:
    """All runs of a session in the order they are started: scenario by scenario, seed by seed."""
    runs: list[Run] = []
    for scenario in scenarios:
        first = options.seed if options.seed is not None else scenario.spec.seed
        for seed in range(first, first + options.repeat):
            for variation in ("", "again") if options.twice else ("",):
                key = RunKey(scenario.id, seed, variation)
                folder = out / scenario.id / key.folder
                runs.append(Run(key, scenario, Job(len(runs), scenario, seed, folder, options.wall_limit)))
    return runs


def run_session(
    runs: Sequence[Run], options: Options, entry: str, listen: Listener, clock: Callable[[], float]
) -> tuple[list[RunFinished], Exit | None]:
    """Do all runs; every one of them is answered, in the order they finish, whatever happens.

    Returns the answers and, when the session was interrupted, the exit code that says so. `clock` is the wall clock.
    """
    by_number, tally, answers = {run.job.number: run for run in runs}, _Tally(), {}
    started: dict[int, float] = {}

    def go_on() -> bool:
        return not options.fail_fast or tally.clean

    def answer(finished: RunFinished, number: int) -> None:
        answers[number] = finished
        tally.add(finished)
        listen(finished)

    stopped: Exit | None = None
    try:
        for happening in supervise([run.job for run in runs], options.workers, entry, go_on):
            run = by_number[happening.job.number]
            match happening:
                case Started():
                    started[happening.job.number] = clock()
                    listen(RunStarted(run.key, run.scenario.path, run.scenario.spec.time_limit))
                case Advanced(seconds=seconds):
                    listen(RunProgress(run.key, seconds))
                case Ended(exit=exit_):
                    answer(told(run.key, run.scenario, run.job.folder, exit_), happening.job.number)
    except Interrupted as interrupted:
        stopped = Exit(128 + interrupted.number)
    for number, run in by_number.items():
        if number not in answers:
            answer(_not_done(run, number in started, stopped), number)
    return list(answers.values()), stopped


def _not_done(run: Run, begun: bool, stopped: Exit | None) -> RunFinished:
    if begun and stopped:
        failure = RunFailure("interrupted", "interrupted before it was finished")
    elif begun:
        failure = RunFailure("interrupted", "stopped because another run did not pass (--fail-fast)")
    else:
        why = "interrupted" if stopped else "another run did not pass (--fail-fast)"
        failure = RunFailure("not-run", f"not run: {why}")
    return RunFinished(run.key, run.scenario.path, 1, Outcome.ERROR, error=failure)
