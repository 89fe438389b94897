"""Verdicts of criteria, declarations of expected failures, and the evidence that a verdict needs from a log."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from enum import Enum


class Status(str, Enum):
    """Status of a finding or verdict.

    INCONCLUSIVE means that the trace does not contain what is needed to decide. ERROR means that nothing was checked,
    or that the trace is invalid.
    """

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"


@dataclass(frozen=True)
class Finding:
    """One checked bound: a measured value and its limit.

    Attributes:
        what: Measured quantity, such as "path_length" or "goal shelf".
        measured: Measured value as text.
        limit: Limit as text.
        margin: Distance of the value from the limit in `unit`, negative if the limit is violated; None if the bound has
            no margin.
        value: Measured value in `unit`; None if it is not a number.
        tick: Tick with the smallest margin; None if the bound does not belong to a time.
        place: True position (x, y) of the robot in m at this tick; None if unknown.
        detail: Lines that explain the result.
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
    """Result of a criterion: the status of its worst finding.

    `criterion` is the key of the criterion, and `id` the name of the verdict in reports. `severity` is "fail" if a
    violation fails the run, and "warn" if it is only reported.
    """

    criterion: str
    id: str
    severity: str
    findings: tuple[Finding, ...] = field(default=())

    @property
    def status(self) -> Status:
        """The worst status of the findings, in the order ERROR, FAIL, INCONCLUSIVE, PASS; ERROR if there are none."""
        order = [Status.ERROR, Status.FAIL, Status.INCONCLUSIVE, Status.PASS]
        return min((f.status for f in self.findings), key=order.index, default=Status.ERROR)

    @property
    def tightest(self) -> Finding | None:
        """The finding with the smallest margin among those with the status of the verdict; None without findings."""
        deciding = [f for f in self.findings if f.status is self.status]
        return min(deciding, key=lambda f: f.margin if f.margin is not None else float("inf"), default=None)


@dataclass(frozen=True)
class ExpectedFailure:
    """Statement of a scenario that its runs fail, and for which reason.

    `criteria` are the ids of the verdicts that must fail; empty if any may fail. `line` is the line in the scenario
    file; 0 if unknown.
    """

    reason: str
    criteria: tuple[str, ...] = ()
    line: int = 0


class Evidence(str, Enum):
    """Kind of information in a log that a criterion may need. The value completes the message "the log lacks …"."""

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
"""Evidence that is needed to compare the true position with positions on the map."""


@dataclass(frozen=True)
class LogCoverage:
    """States which evidence a log lacks, each with the reason.

    `missing` evidence is not in the log at all, `partial` evidence only for a part of the time. The log of another
    recorder (`recorded_by_simscen` False) may contain signals that are irregular or not finite. In a log of simscen,
    such signals mean that the simulation or the log is broken.
    """

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)
    recorded_by_simscen: bool = True

    def lacking(self, required: Set[Evidence]) -> list[Evidence]:
        """Return the required evidence that is not in the log at all."""
        return [evidence for evidence in Evidence if evidence in self.missing and evidence in required]

    def with_gaps(self, gaps: Mapping[Evidence, str]) -> "LogCoverage":
        """Return the coverage with more partial evidence: `gaps` contains the reason for each."""
        return replace(self, partial={**gaps, **self.partial})


COMPLETE_COVERAGE = LogCoverage()
"""Coverage of a run that was just simulated: nothing is missing."""
