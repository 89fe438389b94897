"""Events of a session, which reporters listen to, and the comparison of stacks at its end."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.records.run_result import Outcome, RunKey, RunResult


@dataclass(frozen=True)
class OutcomeCounts:
    """How many runs came out how."""

    passed: int = 0
    failed: int = 0
    errors: int = 0

    @property
    def decided(self) -> int:
        """The runs that say something about the robot: an error says nothing."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Flip:
    """A seed of a scenario that passes with one of two stacks and fails with the other; `why` is what it failed of."""

    scenario: str
    seed: int
    passed: str
    failed: str
    why: str


@dataclass(frozen=True)
class MetricDifference:
    """A metric of a stack minus that of the baseline, over the `pairs` of runs that can be compared.

    `baseline` and `value` are the means of these runs, `interval` that of the mean difference with 95 %, None for too
    few pairs. `lower`, `equal` and `higher` count pairs; `p` is the sign test of lower and higher.
    """

    metric: str
    unit: str
    pairs: int
    baseline: float
    value: float
    difference: float
    interval: tuple[float, float] | None
    lower: int
    equal: int
    higher: int
    p: float


@dataclass(frozen=True)
class BaselineComparison:
    """One stack against the baseline: the `pairs` of runs that both came to an end, and what was left out.

    `broken` pairs have a run that could not be completed, `alone` runs have no partner at all. `parted` are the pairs
    of which only one reached the last goal: how they drove is compared in nothing but collisions. `p` is the sign test
    of the flips.
    """

    stack: str
    pairs: int
    broken: int
    alone: int
    parted: int
    flips: tuple[Flip, ...]
    p: float
    differences: tuple[MetricDifference, ...]


@dataclass(frozen=True)
class Comparison:
    """`stacks` maps names to what was given as --stack, in that order; the first is the baseline of the others.

    `outcomes` are for each scenario those of each stack, by name.
    """

    stacks: Mapping[str, str]
    outcomes: Mapping[str, Mapping[str, OutcomeCounts]]
    against: tuple[BaselineComparison, ...]

    @property
    def baseline(self) -> str:
        """What the others are compared with."""
        return next(iter(self.stacks))

    def total(self, stack: str) -> OutcomeCounts:
        """All scenarios together."""
        counts = [row[stack] for row in self.outcomes.values()]
        return OutcomeCounts(*(sum(getattr(one, name) for one in counts) for name in ("passed", "failed", "errors")))


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
    `warnings` are those of the external stack. `resumed`: --resume kept it from the session before.
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
