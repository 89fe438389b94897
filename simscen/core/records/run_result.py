"""What came of one run: the one record that reports, journals, studies and people read."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import total_ordering

from simscen.core.records.events import DisturbanceOutcome
from simscen.core.records.verdict import Verdict


class Outcome(str, Enum):
    """How a run came out: `error` means that it could not be completed, which is never a verdict on the robot."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"
    FAILED_AS_EXPECTED = "failed-as-expected"
    SKIPPED = "skipped"

    @property
    def good(self) -> bool:
        """Whether it is as the scenario says: passed, failed as expected, or skipped."""
        return self not in (Outcome.FAILED, Outcome.ERROR)


REPEAT_SUFFIX = "again"
"""What the second of two runs is called that must be equal; no stack may be called so."""
_SEPARATOR = "@"
"""Stands between a variation and a stack in a folder's name; neither of their names may hold it."""


@total_ordering
@dataclass(frozen=True)
class RunKey:
    """Names one run: the scenario's id, the seed, the scenario's variation, and the stack where there are several.

    `variation` is "" where the scenario has none. `stack_name` has `.again` behind it for the second of two runs that
    must be equal. Keys are in the order of scenario, variation, seed and stack.
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
        """What is run, as -k sees it: the scenario's id, with its variation as pytest writes parameters."""
        return scenario_title(self.scenario, self.variation)

    @property
    def folder(self) -> str:
        """The run's folder inside its scenario's, e.g. "seed-7", "seed-7-slow" or "seed-7-speed=0.5@slow"."""
        label = _SEPARATOR.join(part for part in (self.variation, self.stack_name) if part)
        return "-".join(part for part in (f"seed-{self.seed}", label) if part)

    @property
    def twin(self) -> "RunKey":
        """The second of two runs that must be equal."""
        return replace(self, stack_name=".".join(part for part in (self.stack_name, REPEAT_SUFFIX) if part))

    @property
    def first(self) -> "RunKey":
        """The first of two runs that must be equal; itself where it is no second one."""
        return (
            replace(self, stack_name=self.stack_name[: -len(REPEAT_SUFFIX)].removesuffix(".")) if self.repeats else self
        )

    @property
    def repeats(self) -> bool:
        """Whether it is a second run, there only to be compared with the first."""
        return self.stack_name == REPEAT_SUFFIX or self.stack_name.endswith(f".{REPEAT_SUFFIX}")


def scenario_title(scenario: str, variation: str) -> str:
    """What a scenario, or a variation of it, is called: "navigation/speeds[speed=0.5]"."""
    return f"{scenario}[{variation}]" if variation else scenario


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
class RunResult:
    """All that a run says about itself; nothing in it depends on the machine, the clock or the working folder.

    `path` is the scenario's file relative to the root, `lines` the line of each verdict in it, in the order of
    `verdicts` (empty or 0 = unknown). `undefined` says of each metric that is None why. `events` counts what happened,
    by kind. `disturbances` is what became of each event and fault of the scenario; each that had to happen and did not
    has a verdict of its own, before those of the criteria. `ended` is why the simulation stopped, `simulated` is in
    seconds, `tick_rate` turns the findings' ticks into seconds. `error` is set exactly when the outcome is ERROR.
    `stack` is the NAME=VALUE of the --stack that it ran with, files seen from the root; "" = the scenario's own stack.
    `reason` is the scenario's, where it is expected to fail or skipped.
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
    def again(self) -> str:
        """The command that repeats the run, from the scenario's root."""
        varied = ["--variation", self.key.variation] if self.key.variation else []
        chosen = ["--stack", self.stack] if self.stack else []
        return shlex.join(["simscen", "run", self.path, "--seed", str(self.key.seed), *varied, *chosen])


def skipped_result(key: RunKey, path: str, reason: str, stack: str = "") -> RunResult:
    """The result of a run that its scenario says is not to be run."""
    return RunResult(key, path, Outcome.SKIPPED, stack=stack, reason=reason)


def error_result(key: RunKey, path: str, failure: RunFailure, stack: str = "") -> RunResult:
    """The result of a run that could not be completed."""
    return RunResult(key, path, Outcome.ERROR, error=failure, stack=stack)
