"""What happens while scenarios run: the events that reporters listen to. The runner does not know who listens."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from simscen.core.verdict import Verdict


class Outcome(str, Enum):
    """How a run came out: `error` means that it could not be completed, which is never a verdict on the robot."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"


@dataclass(frozen=True, order=True)
class RunKey:
    """Names one run: the scenario's id, the seed, and a label of the variation where there are several."""

    scenario: str
    seed: int
    variation: str = ""

    @property
    def folder(self) -> str:
        """The run's folder inside its scenario's, e.g. "seed-7" or "seed-7-slow"."""
        return "-".join(part for part in (f"seed-{self.seed}", self.variation) if part)


@dataclass(frozen=True)
class Artifacts:
    """Where a run left its files, as paths to print; "" = not written."""

    folder: str = ""
    mcap: str = ""
    picture: str = ""
    result: str = ""


@dataclass(frozen=True)
class RunFailure:
    """Why a run could not be completed.

    `kind` is JUnit's error type: crashed, timeout, out-of-memory, invalid, interrupted, not-run, internal. `tail` is
    the end of the worker's log: text from outside, to be shown literally.
    """

    kind: str
    message: str
    tail: str = ""


@dataclass(frozen=True)
class SessionStarted:
    """The first event: `total` runs of `scenarios` files will be spread over `workers` processes.

    `ids` are the scenarios' ids.
    """

    version: str
    total: int
    scenarios: int
    workers: int
    folder: str = ""
    ids: tuple[str, ...] = ()


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
    """A run is over.

    `path` and `line` are where the scenario is written (line from 1). `lines` holds the line of each criterion, in the
    order of `verdicts`; empty or 0 = unknown. `ended` is why the simulation stopped. `metrics` are numbers by name.
    `error` is set exactly when the outcome is ERROR. `again` is the command that repeats this run.
    `tick_rate` turns the findings' ticks into seconds. `file` is the scenario as seen from the working folder, for
    people to open; "" = `path`.
    """

    key: RunKey
    path: str
    line: int
    outcome: Outcome
    verdicts: tuple[Verdict, ...] = ()
    lines: tuple[int, ...] = ()
    simulated: float = 0.0
    wall: float = 0.0
    ended: str = ""
    metrics: tuple[tuple[str, float | None], ...] = ()
    artifacts: Artifacts = field(default_factory=Artifacts)
    error: RunFailure | None = None
    again: str = ""
    tick_rate: int = 240
    file: str = ""


@dataclass(frozen=True)
class SessionFinished:
    """The last event: counts, simulated and wall seconds of the whole session, and where the reports are."""

    passed: int
    failed: int
    errors: int
    simulated: float
    wall: float
    interrupted: bool = False
    junit: str = ""
    folder: str = ""


SessionEvent = SessionStarted | RunStarted | RunProgress | RunFinished | SessionFinished
Listener = Callable[[SessionEvent], None]
