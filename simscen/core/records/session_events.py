"""Events of a session (one call of `simscen run`). All reports are made from these events."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.records.comparison import Comparison
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.study import Study


@dataclass(frozen=True)
class Artifacts:
    """Paths of the output files of a run, as reports print them; "" for a file that was not written."""

    folder: str = ""
    mcap: str = ""
    picture: str = ""
    result: str = ""
    replay: str = ""


@dataclass(frozen=True)
class SessionStarted:
    """First event of a session, with its plan.

    Attributes:
        version: Version of simscen.
        total: Number of runs.
        scenarios: Number of scenarios.
        workers: Number of worker processes.
        folder: Path of the output folder.
        ids: Titles of the scenarios and variations.
        stacks: Values of --stack.
        twice: Whether each run is repeated to check that both runs have the same log.
        seeds: Largest number of different seeds of a scenario or variation.
    """

    version: str
    total: int
    scenarios: int
    workers: int
    folder: str = ""
    ids: tuple[str, ...] = ()
    stacks: tuple[str, ...] = ()
    twice: bool = False
    seeds: int = 1


def session_started(
    version: str, runs: Sequence[RunKey], workers: int, folder: Path, stacks: tuple[str, ...]
) -> SessionStarted:
    """Return the first event of a session with these runs, and with one stack or the compared `stacks`.

    `workers` is the number of worker processes. `folder` is the output folder.
    """
    tests = Counter(test for test, _ in {(key.test, key.seed) for key in runs})
    scenarios = len({key.scenario for key in runs})
    twice = any(key.is_repetition for key in runs)
    ids, seeds = tuple(sorted(tests)), max(tests.values(), default=1)
    return SessionStarted(version, len(runs), scenarios, workers, str(folder), ids, stacks, twice, seeds)


@dataclass(frozen=True)
class RunStarted:
    """A run of the scenario file `path` has started. `time_limit` is the maximum simulated time in s."""

    key: RunKey
    path: str
    time_limit: float = 0.0


@dataclass(frozen=True)
class RunProgress:
    """Progress of a run: the `simulated` time in s."""

    key: RunKey
    simulated: float


@dataclass(frozen=True)
class RunFinished:
    """A run has finished: its result, and data that are valid only in this session.

    Attributes:
        wall: Wall time of the run in s.
        artifacts: Output files.
        again: Command that repeats the run from the working folder; "" if it is the same as `result.again`, or if no
            command repeats the run.
        file: Path of the scenario, relative to the working folder; "" if it is the same as `result.path`.
        tags: Tags of the scenario.
        warnings: Warnings of the external stack.
        resumed: Whether the result is from an earlier session (--resume).
    """

    result: RunResult
    wall: float = 0.0
    artifacts: Artifacts = field(default_factory=Artifacts)
    again: str = ""
    file: str = ""
    tags: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    resumed: bool = False

    @property
    def key(self) -> RunKey:
        """Key of the run."""
        return self.result.key

    @property
    def outcome(self) -> Outcome:
        """Outcome of the run."""
        return self.result.outcome


@dataclass(frozen=True)
class SessionFinished:
    """Last event of a session.

    Attributes:
        passed: Number of runs that passed. `failed`, `errors`, and `skipped` are the numbers of other outcomes.
        simulated: Sum of the simulated times of all runs in s.
        wall: Wall time of the session in s.
        interrupted: Whether the session ended before all runs were finished.
        junit: Path of the JUnit report; "" if there is none.
        folder: Path of the output folder.
        comparison: Comparison of the stacks; None for one stack.
        expected: Number of runs that failed as expected.
        page: Path of the report page; "" if there is none.
        study: Result of `simscen study`; None for other commands.
        is_resumable: Whether the command has the option --resume.
    """

    passed: int
    failed: int
    errors: int
    simulated: float
    wall: float
    interrupted: bool = False
    junit: str = ""
    folder: str = ""
    comparison: Comparison | None = None
    expected: int = 0
    skipped: int = 0
    page: str = ""
    study: Study | None = None
    is_resumable: bool = True


SessionEvent = SessionStarted | RunStarted | RunProgress | RunFinished | SessionFinished
Listener = Callable[[SessionEvent], None]
"""Function that is called with each event of a session, such as a reporter."""


def broadcast(*listeners: Listener) -> Listener:
    """Return a listener that passes each event to all `listeners` in order."""

    def listen(event: SessionEvent) -> None:
        for listener in listeners:
            listener(event)

    return listen
