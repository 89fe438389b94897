"""Verdicts of criteria, declarations of expected failures, and the evidence that criteria need from a log."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from enum import Enum


class Status(str, Enum):
    """Status of a finding or verdict.

    INCONCLUSIVE: the trace (the recorded states of the run) does not contain the necessary data. ERROR: nothing was
    checked, or the trace is invalid.
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
        margin: Distance of the value from the limit in `unit`; negative if the limit is violated; None if undefined.
        value: Measured value in `unit`; None if it is not a number.
        tick: Tick that decides the finding, such as that of the largest value; None if no single tick decides it.
        place: True position (x, y) of the robot in m at this tick; None if unknown.
        detail: Explanation, as lines of text.
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
    """Result of a criterion.

    `criterion` is the key of the criterion in the scenario. `id` is the name of the verdict in reports. `severity` is
    "fail" if a violation fails the run, and "warn" if a violation is only reported.
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
        """Finding with the smallest margin among the findings with the status of the verdict; None without findings."""
        deciding = [f for f in self.findings if f.status is self.status]
        return min(deciding, key=lambda f: f.margin if f.margin is not None else float("inf"), default=None)


@dataclass(frozen=True)
class ExpectedFailure:
    """Declaration in a scenario that its runs are expected to fail.

    `criteria` are the ids of verdicts: at least one of them must fail, and none may pass. Without `criteria`, at
    least one verdict must fail. `line` is the line in the scenario file; 0 if unknown.
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
    PLANNING = "the reasons why plans were computed"
    RECOVERIES = "the recoveries"
    OBJECTS = "the poses of moving objects"
    DISTURBANCES = "the times of faults and events"
    ALIGNMENT = "the transform from the true poses to the map"
    FOOTPRINT = "the footprint of the robot"


POSITION_EVIDENCE = frozenset({Evidence.TRUTH, Evidence.ALIGNMENT})
"""Evidence for comparing the true position of the robot with positions on the map."""


@dataclass(frozen=True)
class LogCoverage:
    """Coverage of a log: the evidence that the log lacks, each with the reason.

    `missing` evidence is not in the log. `partial` evidence covers only a part of the run. Logs of other recorders
    (`recorded_by_simscen` is False) can contain irregular signals and values that are not finite.
    """

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)
    recorded_by_simscen: bool = True

    def missing_from(self, required: Set[Evidence]) -> list[Evidence]:
        """Return the required evidence that is missing."""
        return [evidence for evidence in Evidence if evidence in self.missing and evidence in required]


COMPLETE_COVERAGE = LogCoverage()
"""Coverage of a log that lacks nothing."""


def unique_name(name: str, used_names: set[str], separator: str = "#") -> str:
    """Return `name`, with the first free number from 2 if `name` is used already; add the result to `used_names`."""
    candidate, number = name, 2
    while candidate in used_names:
        candidate, number = f"{name}{separator}{number}", number + 1
    used_names.add(candidate)
    return candidate
