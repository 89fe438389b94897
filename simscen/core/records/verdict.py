"""Verdicts of criteria, declarations of expected failures, and the evidence that a log holds for a verdict."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from enum import Enum


class Status(str, Enum):
    """What a criterion says: inconclusive means that the trace is too short to decide."""

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"


@dataclass(frozen=True)
class Finding:
    """One bound that was checked: what was measured, against what, when and where it was tightest.

    `margin` > 0 holds, < 0 is violated, in `unit`; None where a margin makes no sense. `what` is a phrase such as
    "path_length" or "goal shelf"; `detail` explains a failure in one line each.
    """

    status: Status
    what: str
    measured: str
    limit: str
    margin: float | None = None
    unit: str = ""
    value: float | None = None
    tick: int | None = None
    place: tuple[float, float] | None = None
    detail: tuple[str, ...] = ()


@dataclass(frozen=True)
class Verdict:
    """A criterion's answer: its worst finding decides, its tightest finding is shown on a pass."""

    criterion: str
    id: str
    severity: str
    findings: tuple[Finding, ...] = field(default=())

    @property
    def status(self) -> Status:
        """The worst of the findings; a criterion that found nothing to check is an error, never a pass."""
        order = [Status.ERROR, Status.FAIL, Status.INCONCLUSIVE, Status.PASS]
        return min((f.status for f in self.findings), key=order.index, default=Status.ERROR)

    @property
    def tightest(self) -> Finding | None:
        """The finding that decides: among those with the verdict's status the one with the least margin."""
        deciding = [f for f in self.findings if f.status is self.status]
        return min(deciding, key=lambda f: f.margin if f.margin is not None else float("inf"), default=None)


@dataclass(frozen=True)
class ExpectedFailure:
    """Why a run is expected to fail; `criteria` are the ids of the verdicts that do, () = whichever.

    `line` is where that is written in the scenario's own file; 0 = unknown.
    """

    reason: str
    criteria: tuple[str, ...] = ()
    line: int = 0


class Evidence(str, Enum):
    """A kind of information about a run, in words that end the sentence "the log does not say …"."""

    TRUTH = "where the robot truly was"
    VELOCITY = "how fast the robot truly went"
    CLEARANCE = "how near obstacles truly were"
    CONTACTS = "what the robot touched"
    BELIEF = "where the robot believed to be"
    COVARIANCE = "how sure it was of that"
    SCANS = "when scans came"
    COMMANDS = "which velocities were commanded"
    PLANS = "which plans were made"
    NAVIGATION = "what became of goals"
    ERROR_CODES = "the navigation's error codes"
    PLANNING = "why plans were made"
    RECOVERIES = "which recoveries there were"
    OBJECTS = "where things that move were"
    DISTURBANCES = "when faults and events happened"
    ALIGNMENT = "how the truth lies on the map"
    FOOTPRINT = "how much ground the robot covers"


POSITION = frozenset({Evidence.TRUTH, Evidence.ALIGNMENT})
"""What is needed to compare the true position with places of the map."""


@dataclass(frozen=True)
class LogCoverage:
    """Evidence that a log lacks, each with the reason: `missing` altogether, or for a part of the time (`partial`).

    `recorded_by_simscen` is False for the log of another recorder, whose signals may be irregular or not finite. In a
    log of simscen's own, that means that the simulation or the log is broken.
    """

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)
    recorded_by_simscen: bool = True

    def lacking(self, wanted: Set[Evidence]) -> list[Evidence]:
        """Return the wanted evidence that is missing altogether."""
        return [evidence for evidence in Evidence if evidence in self.missing and evidence in wanted]

    def with_gaps(self, gaps: Mapping[Evidence, str]) -> "LogCoverage":
        """Return the same coverage with more evidence that is there only for a part of the time."""
        return replace(self, partial={**gaps, **self.partial})


COMPLETE_COVERAGE = LogCoverage()
"""Coverage of a run that was just simulated: nothing is missing."""
