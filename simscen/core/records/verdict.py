"""Verdicts of criteria, declarations of expected failures, and the evidence that a log holds for a verdict."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from enum import Enum


class Status(str, Enum):
    """Status of a verdict. INCONCLUSIVE: the trace does not contain what is needed to decide."""

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"


@dataclass(frozen=True)
class Finding:
    """One checked bound: the measured value, its limit, and the time and place with the smallest margin.

    `margin` is in `unit`, and negative if the limit is violated; None if the bound has no margin. `what` is a phrase
    such as "path_length" or "goal shelf"; `detail` explains a failure in one line each.
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
    """Result of a criterion. The worst finding decides; reports show the tightest finding of a pass."""

    criterion: str
    id: str
    severity: str
    findings: tuple[Finding, ...] = field(default=())

    @property
    def status(self) -> Status:
        """The worst status of the findings; ERROR if there are none, since then nothing was checked."""
        order = [Status.ERROR, Status.FAIL, Status.INCONCLUSIVE, Status.PASS]
        return min((f.status for f in self.findings), key=order.index, default=Status.ERROR)

    @property
    def tightest(self) -> Finding | None:
        """The deciding finding: the one with the smallest margin among those with the status of the verdict."""
        deciding = [f for f in self.findings if f.status is self.status]
        return min(deciding, key=lambda f: f.margin if f.margin is not None else float("inf"), default=None)


@dataclass(frozen=True)
class ExpectedFailure:
    """Reason why a run is expected to fail; `criteria` are the ids of the verdicts that fail, () for any.

    `line` is the line in the scenario file; 0 if unknown.
    """

    reason: str
    criteria: tuple[str, ...] = ()
    line: int = 0


class Evidence(str, Enum):
    """Kind of information about a run. The value completes the message "the log lacks …"."""

    TRUTH = "the true pose of the robot"
    VELOCITY = "the true velocity of the robot"
    CLEARANCE = "the clearance"
    CONTACTS = "the collisions of the robot"
    BELIEF = "the estimated pose"
    COVARIANCE = "the covariance of the estimated pose"
    SCANS = "the times of the scans"
    COMMANDS = "the commanded velocities"
    PLANS = "the plans"
    NAVIGATION = "the outcomes of the goals"
    ERROR_CODES = "the error codes of the navigation"
    PLANNING = "the reasons for the plans"
    RECOVERIES = "the recoveries"
    OBJECTS = "the poses of moving objects"
    DISTURBANCES = "the times of faults and events"
    ALIGNMENT = "the transform from the true poses to the map"
    FOOTPRINT = "the footprint of the robot"


POSITION = frozenset({Evidence.TRUTH, Evidence.ALIGNMENT})
"""Evidence for comparing the true position with places on the map."""


@dataclass(frozen=True)
class LogCoverage:
    """Evidence that a log lacks, each with the reason: `missing` completely, or `partial` for a part of the time.

    `recorded_by_simscen` is False for the log of another recorder, whose signals may be irregular or not finite. If
    signals in simscen's own logs are irregular or not finite, the simulation or the log is broken.
    """

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)
    recorded_by_simscen: bool = True

    def lacking(self, required: Set[Evidence]) -> list[Evidence]:
        """Return the required evidence that is missing completely."""
        return [evidence for evidence in Evidence if evidence in self.missing and evidence in required]

    def with_gaps(self, gaps: Mapping[Evidence, str]) -> "LogCoverage":
        """Return the coverage with additional evidence that covers only a part of the time."""
        return replace(self, partial={**gaps, **self.partial})


COMPLETE_COVERAGE = LogCoverage()
"""Coverage of a run that was just simulated: nothing is missing."""
