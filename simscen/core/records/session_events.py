"""Events of a session, which reporters listen to, and the comparison of stacks at its end."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.study import Study


@dataclass(frozen=True)
class OutcomeCounts:
    """Number of runs by outcome."""

    passed: int = 0
    failed: int = 0
    errors: int = 0

    @property
    def decided(self) -> int:
        """Number of completed runs."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Flip:
    """A scenario and seed that passes with only one of two stacks or sessions; `why` is the failed criterion."""

    scenario: str
    seed: int
    passed: str
    failed: str
    why: str


@dataclass(frozen=True)
class MetricDifference:
    """Difference of a metric between a stack or session and the baseline, over the `pairs` that can be compared.

    `baseline` and `value` are means; `interval` is the 95 % confidence interval of their difference, None for too few
    pairs. `lower`, `equal`, and `higher` count pairs; `p` is the p-value of Wilcoxon's signed-rank test.
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
class ScenarioChange:
    """Significant change of the pass rate or of the mean of a metric, in one scenario or in all.

    `p` is adjusted for the number of tests (Holm). `is_worse` is None for a metric that may go either way.
    """

    scenario: str
    what: str
    unit: str
    pairs: int
    baseline: float
    value: float
    p: float
    is_worse: bool | None


@dataclass(frozen=True)
class BaselineComparison:
    """Comparison of one stack or session with the baseline, over the `pairs` of completed runs.

    `broken` counts the pairs with a run that could not be completed, `alone` the runs without a partner, and `parted`
    the pairs of which only one run reached the last goal; of `parted` pairs, only collisions are compared. `p` is the
    p-value of the sign test of the flips. `changes` are the significant changes.
    """

    stack: str
    pairs: int
    broken: int
    alone: int
    parted: int
    flips: tuple[Flip, ...]
    p: float
    differences: tuple[MetricDifference, ...]
    changes: tuple[ScenarioChange, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """Comparison of stacks or sessions, of which the first one is the baseline.

    `stacks` maps names to the values of --stack, or to output folders. `outcomes` contains for each scenario the
    outcomes of each of them by name.
    """

    stacks: Mapping[str, str]
    outcomes: Mapping[str, Mapping[str, OutcomeCounts]]
    against: tuple[BaselineComparison, ...]

    @property
    def baseline(self) -> str:
        """Name of the baseline stack."""
        return next(iter(self.stacks))

    def total(self, stack: str) -> OutcomeCounts:
        """Return the outcomes of a stack over all scenarios."""
        counts = [row[stack] for row in self.outcomes.values()]
        return OutcomeCounts(
            *(sum(getattr(count, name) for count in counts) for name in ("passed", "failed", "errors"))
        )


@dataclass(frozen=True)
class Artifacts:
    """Paths of the files of a run, for printing; "" = not written."""

    folder: str = ""
    mcap: str = ""
    picture: str = ""
    result: str = ""
    replay: str = ""


@dataclass(frozen=True)
class SessionStarted:
    """First event of a session: `total` runs of `scenarios` files on `workers` processes.

    `ids` contains the titles of scenarios and variations, `stacks` the values of --stack. `twice`: each run has
    a second one that must be equal.
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
    """Return the first event of a session with these runs."""
    ids = tuple(sorted({key.test for key in runs}))
    scenarios = len({key.scenario for key in runs})
    twice = any(key.repeats for key in runs)
    return SessionStarted(version, len(runs), scenarios, workers, str(folder), ids, stacks, twice)


@dataclass(frozen=True)
class RunStarted:
    """A worker has started a run of the scenario file `path`."""

    key: RunKey
    path: str
    time_limit: float = 0.0


@dataclass(frozen=True)
class RunProgress:
    """Progress of a run: simulated time in s, and the current activity, e.g. "goal shelf"."""

    key: RunKey
    simulated: float
    note: str = ""


@dataclass(frozen=True)
class RunFinished:
    """A run has finished: its result and data of this session.

    `wall` is the wall time in s. `again` is the command that repeats the run, and `file` the path of the scenario, both
    from the working folder; "" = that of the result. `warnings` are those of the external stack. `resumed`: the result
    was kept from an earlier session by --resume.
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
    """Last event of a session: number of runs by outcome, simulated and wall time in s, and paths of the reports.

    `expected` counts runs that failed as expected, `skipped` those that were not run. `comparison` compares several
    stacks. `page` is the report page. `study` is the result of `simscen study`.
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


SessionEvent = SessionStarted | RunStarted | RunProgress | RunFinished | SessionFinished
Listener = Callable[[SessionEvent], None]
