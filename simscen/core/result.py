"""What came of one run: the one record that reports, journals, studies and people read."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from simscen.core.disturbance import Happening
from simscen.core.verdict import Verdict


class Outcome(str, Enum):
    """How a run came out: `error` means that it could not be completed, which is never a verdict on the robot."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"


AGAIN = "again"
"""What the second of two runs is called that must be equal; no stack may be called so."""


@dataclass(frozen=True, order=True)
class RunKey:
    """Names one run: the scenario's id, the seed, and a label of the variation where there are several.

    The variation is the name of the stack where there are several, with `.again` for the second of two equal runs.
    """

    scenario: str
    seed: int
    variation: str = ""

    @property
    def folder(self) -> str:
        """The run's folder inside its scenario's, e.g. "seed-7" or "seed-7-slow"."""
        return "-".join(part for part in (f"seed-{self.seed}", self.variation) if part)

    @property
    def twin(self) -> "RunKey":
        """The second of two runs that must be equal."""
        return replace(self, variation=".".join(part for part in (self.variation, AGAIN) if part))

    @property
    def first(self) -> "RunKey":
        """The first of two runs that must be equal; itself where it is no second one."""
        return replace(self, variation=self.variation[: -len(AGAIN)].removesuffix(".")) if self.repeats else self

    @property
    def repeats(self) -> bool:
        """Whether it is a second run, there only to be compared with the first."""
        return self.variation == AGAIN or self.variation.endswith(f".{AGAIN}")


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
    """

    key: RunKey
    path: str
    outcome: Outcome
    verdicts: tuple[Verdict, ...] = ()
    lines: tuple[int, ...] = ()
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    undefined: Mapping[str, str] = field(default_factory=dict)
    events: Mapping[str, int] = field(default_factory=dict)
    disturbances: tuple[Happening, ...] = ()
    ended: str = ""
    simulated: float = 0.0
    tick_rate: int = 240
    error: RunFailure | None = None
    stack: str = ""

    def __post_init__(self) -> None:
        if (self.error is not None) != (self.outcome is Outcome.ERROR):
            raise ValueError(f"outcome {self.outcome.value} with error {self.error}")

    @property
    def again(self) -> str:
        """The command that repeats the run, from the scenario's root."""
        chosen = ["--stack", self.stack] if self.stack else []
        return shlex.join(["simscen", "run", self.path, "--seed", str(self.key.seed), *chosen])


def unfinished(key: RunKey, path: str, failure: RunFailure, stack: str = "") -> RunResult:
    """The result of a run that could not be completed."""
    return RunResult(key, path, Outcome.ERROR, error=failure, stack=stack)
