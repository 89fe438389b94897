"""The verdict of one pass criterion with its margin, and the declaration that a run is expected to fail."""

from dataclasses import dataclass, field
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
