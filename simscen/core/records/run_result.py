"""Result of a run, and the key that identifies a run in a session (one call of `simscen run`)."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import total_ordering

from simscen.core.records.disturbances import DisturbanceOutcome
from simscen.core.records.verdict import Verdict


class Outcome(str, Enum):
    """Outcome of a run. ERROR means that the run could not be completed."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"
    FAILED_AS_EXPECTED = "failed-as-expected"
    SKIPPED = "skipped"

    @property
    def is_good(self) -> bool:
        """Whether the outcome is as intended: passed, failed as expected, or skipped."""
        return self not in (Outcome.FAILED, Outcome.ERROR)


REPEAT_SUFFIX = "again"
"""Suffix of `RunKey.stack_name` for the repetition of a run."""
PROPOSAL_PREFIX = "search-"
"""Prefix of `RunKey.variation` for values that `simscen falsify` proposed. A number follows."""
_SEPARATOR = "@"
"""Separator between variation and stack in folder names."""


@total_ordering
@dataclass(frozen=True, slots=True)
class RunKey:
    """Identifies a run in a session.

    `scenario` is the id of the scenario. `variation` and `stack_name` are "" if there is only one. A run can be
    repeated to check that it is deterministic; the `stack_name` of the repetition ends with REPEAT_SUFFIX. Keys are
    ordered by scenario, variation, seed, and stack.
    """

    scenario: str
    seed: int
    variation: str = ""
    stack_name: str = ""

    def __lt__(self, other: "RunKey") -> bool:
        return self._order < other._order

    @property
    def _order(self) -> tuple[str, str, int, str]:
        return self.scenario, self.variation, self.seed, self.stack_name

    @property
    def test(self) -> str:
        """Scenario id with the variation in brackets, as in pytest. The option `-k` selects runs by this name."""
        return scenario_title(self.scenario, self.variation)

    @property
    def folder(self) -> str:
        """Name of the output folder of the run, e.g. "seed-7", "seed-7-slow", or "seed-7-speed=0.5@slow"."""
        label = _SEPARATOR.join(part for part in (self.variation, self.stack_name) if part)
        return "-".join(part for part in (f"seed-{self.seed}", label) if part)

    @property
    def is_proposal(self) -> bool:
        """Whether `simscen falsify` proposed the values of the run. `simscen run` cannot select such a run."""
        return self.variation.startswith(PROPOSAL_PREFIX) and self.variation.removeprefix(PROPOSAL_PREFIX).isdecimal()

    @property
    def repetition(self) -> "RunKey":
        """Key of the repetition of this run."""
        return replace(self, stack_name=".".join(part for part in (self.stack_name, REPEAT_SUFFIX) if part))

    @property
    def original(self) -> "RunKey":
        """Key of the run that this run repeats; the key itself if this run is no repetition."""
        if not self.is_repetition:
            return self
        return replace(self, stack_name=self.stack_name[: -len(REPEAT_SUFFIX)].removesuffix("."))

    @property
    def is_repetition(self) -> bool:
        """Whether this run repeats another run."""
        return self.stack_name == REPEAT_SUFFIX or self.stack_name.endswith(f".{REPEAT_SUFFIX}")


def scenario_title(scenario: str, variation: str) -> str:
    """Return the title of a scenario or variation, such as "navigation/speeds[speed=0.5]"."""
    return f"{scenario}[{variation}]" if variation else scenario


INTERRUPTED, NOT_RUN = "interrupted", "not-run"
"""Values of `RunFailure.kind` for a run that was started but not finished, and for a run that was not started."""
NONDETERMINISTIC = "nondeterministic"
"""Value of `RunFailure.kind` for a run whose log differs from the log of an equal run."""


@dataclass(frozen=True)
class RunFailure:
    """Reason why a run could not be completed.

    `kind` is the error type in JUnit, such as crashed, timeout, out-of-memory, invalid, interrupted, not-run, or
    internal. `tail` is the last output of the external stack or of the worker process. `by_stack` is True if the stack
    under test crashed, did not answer, or gave an invalid answer.
    """

    kind: str
    message: str
    tail: str = ""
    by_stack: bool = False


@dataclass(frozen=True)
class RunResult:
    """Result of a run. It does not depend on the machine, the time of day, or the working folder.

    Attributes:
        path: Scenario file relative to the root, the folder that contains all files of a scenario.
        verdicts: Verdicts of required disturbances that did not take place, then the verdicts of the criteria, then the
            verdict on the expected failure if the scenario declares one.
        lines: Line of each verdict in the scenario file, in the same order; 0 if unknown. Empty if all are unknown.
        metrics: Value of each metric; None if the metric is undefined for the run.
        undefined: Reason for each metric that is None.
        events: Number of events by kind.
        disturbances: Outcome of each event and fault of the scenario.
        ended: Reason why the simulation stopped.
        simulated: Simulated time in s.
        tick_rate: Ticks per second.
        error: Reason why the run could not be completed; None for other outcomes than ERROR.
        stack: Value of the option --stack, with file paths relative to the root; "" for the stack of the scenario.
        reason: Reason that the scenario states for an expected failure or for skipping the run.
    """

    key: RunKey
    path: str
    outcome: Outcome
    verdicts: tuple[Verdict, ...] = ()
    lines: tuple[int, ...] = ()
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    undefined: Mapping[str, str] = field(default_factory=dict)
    events: Mapping[str, int] = field(default_factory=dict)
    disturbances: tuple[DisturbanceOutcome, ...] = ()
    ended: str = ""
    simulated: float = 0.0
    tick_rate: int = 240
    error: RunFailure | None = None
    stack: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        if (self.error is not None) != (self.outcome is Outcome.ERROR):
            raise ValueError(f"outcome {self.outcome.value} with error {self.error}")

    @property
    def verdicts_with_lines(self) -> list[tuple[Verdict, int]]:
        """The verdicts, each with its line in the scenario file; 0 if unknown."""
        return list(zip(self.verdicts, self.lines or (0,) * len(self.verdicts), strict=True))

    @property
    def is_unfinished(self) -> bool:
        """Whether the session ended before the run was started or finished."""
        return self.error is not None and self.error.kind in (INTERRUPTED, NOT_RUN)

    @property
    def again(self) -> str:
        """Command that repeats the run if it is executed in the root; "" if no command does."""
        if self.key.is_proposal:
            return ""
        variation = ["--variation", self.key.variation] if self.key.variation else []
        stack = ["--stack", self.stack] if self.stack else []
        return shlex.join(["simscen", "run", self.path, "--seed", str(self.key.seed), *variation, *stack])


def skipped_result(key: RunKey, path: str, reason: str, stack: str = "") -> RunResult:
    """Return the result of a skipped run."""
    return RunResult(key, path, Outcome.SKIPPED, stack=stack, reason=reason)


def error_result(key: RunKey, path: str, failure: RunFailure, stack: str = "") -> RunResult:
    """Return the result of a run that could not be completed."""
    return RunResult(key, path, Outcome.ERROR, error=failure, stack=stack)
