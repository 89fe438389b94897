"""What happens while scenarios run: the events that reporters listen to. The runner does not know who listens."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.stack_comparison import Comparison


@dataclass(frozen=True)
class Artifacts:
    """Where a run left its files, as paths to print; "" = not written."""

    folder: str = ""
    mcap: str = ""
    picture: str = ""
    result: str = ""
    replay: str = ""


@dataclass(frozen=True)
class SessionStarted:
    """The first event: `total` runs of `scenarios` files will be spread over `workers` processes.

    `ids` are the scenarios' ids, each of its variations for itself where it has some; `stacks` are the NAME=VALUE of
    those that take the place of the scenarios' own. `twice` = each run has a second one that must be equal.
    """

    version: str
    total: int
    scenarios: int
    workers: int
    folder: str = ""
    ids: tuple[str, ...] = ()
    stacks: tuple[str, ...] = ()
    twice: bool = False


def session_started(
    version: str, runs: Sequence[RunKey], workers: int, folder: Path, stacks: tuple[str, ...]
) -> SessionStarted:
    """The first event of a session of these runs."""
    ids = tuple(sorted({key.test for key in runs}))
    scenarios = len({key.scenario for key in runs})
    twice = any(key.repeats for key in runs)
    return SessionStarted(version, len(runs), scenarios, workers, str(folder), ids, stacks, twice)


@dataclass(frozen=True)
class RunStarted:
    """A worker has begun a run of the scenario file `path` (as the user would write it)."""

    key: RunKey
    path: str
    time_limit: float = 0.0


@dataclass(frozen=True)
class RunProgress:
    """A run has got this far: simulated seconds, and what the robot is doing, e.g. "goal shelf"."""

    key: RunKey
    simulated: float
    note: str = ""


@dataclass(frozen=True)
class RunFinished:
    """A run is over: its result, and what only this session knows of it.

    `wall` is in seconds. `again` is the command that repeats the run from the working folder, and `file` the scenario
    as seen from there, for people to open; "" = the result's own. `tags` are the scenario's.
    `warnings` are those of the external stack.
    """

    result: RunResult
    wall: float = 0.0
    artifacts: Artifacts = field(default_factory=Artifacts)
    again: str = ""
    file: str = ""
    tags: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def key(self) -> RunKey:
        """Which run it is."""
        return self.result.key

    @property
    def outcome(self) -> Outcome:
        """How it came out."""
        return self.result.outcome


@dataclass(frozen=True)
class SessionFinished:
    """The last event: counts, simulated and wall seconds of the whole session, and where the reports are.

    `expected` failed as their scenarios say, `skipped` were not run. `comparison` is what several stacks on the same
    scenarios say about each other. `page` is the page that shows the session.
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


SessionEvent = SessionStarted | RunStarted | RunProgress | RunFinished | SessionFinished
Listener = Callable[[SessionEvent], None]
