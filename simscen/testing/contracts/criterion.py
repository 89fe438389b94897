"""The promises of a criterion."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Any

from simscen.core.records.case import Case
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, demand, promise
from simscen.testing.sketch import sketch, sketch_case

CASE: dict[str, Any] = {"goals": [{"name": "shelf", "pose": [2.5, 0.5, 0]}], "shortest": {"shelf": 2.5}}
DRIVE: dict[str, Any] = {
    "seconds": 8,
    "truth": [[0, 0, 0], [4, 2, 0.5], [8, 2.5, 0.5]],
    "events": [
        [0.5, "goal.accepted", "shelf"],
        [2, "fault.started", "lidar.off"],
        [3, "plan.made", "", {"reason": "blocked"}],
        [4, "recovery.started", "spin"],
        [5, "collision.started", "wall", {"x": 1.0, "y": 2.0, "impulse": 1.0, "speed": 0.2}],
        [7, "goal.reached", "shelf"],
        [7, "navigation.ended", "SUCCEEDED", {"error_code": 0}],
    ],
}
STANDS: dict[str, Any] = {"seconds": 2, "truth": [[0, 0, 0]], "belief": None, "scans": []}
CUT_OFF: dict[str, Any] = {**DRIVE, "seconds": 3, "ended": None, "events": DRIVE["events"][:2]}
TRACES = {"a drive": DRIVE, "a robot that stands, without belief or scans": STANDS, "a log that was cut off": CUT_OFF}


@dataclass(frozen=True, eq=False)
class CriterionContract(Contract):
    """Tried on the trace of a drive, of a robot that stands, and of a log that was cut off."""

    role = "criterion"
    spec: Any
    subject: str = ""

    def findings(self, trace: Trace, case: Case, what: str) -> list[Finding]:
        """What it finds, looked at for type."""
        criterion: Criterion = self.spec
        found = heard(f"judges {what}", criterion.judge, trace, case)
        demand(isinstance(found, list) and all(isinstance(f, Finding) for f in found), f"finds {found!r} in {what}")
        return found

    @promise
    def every_bound_yields_a_finding(self) -> None:
        """Given any trace then there is at least one finding: a criterion without findings has checked nothing."""
        for what, words in TRACES.items():
            found = self.findings(sketch(words), sketch_case(CASE), what)
            demand(found, f"finds nothing in {what}, so it checks nothing")
            for finding in found:
                demand(isinstance(finding.status, Status), f"has the status {finding.status!r}")
                demand(finding.what or finding.limit, f"does not say what it checked: {finding}")

    @promise
    def a_margin_has_the_sign_of_the_status(self) -> None:
        """Given a finding with a margin then it passes exactly where the margin is not negative, and is a number."""
        for what, words in TRACES.items():
            for finding in self.findings(sketch(words), sketch_case(CASE), what):
                if finding.margin is None or finding.status not in (Status.PASS, Status.FAIL):
                    continue
                demand(not math.isnan(finding.margin), f"has a margin of nan in {what}")
                passes = finding.status is Status.PASS
                demand(passes == (finding.margin >= 0), f"{finding.status.value} with a margin of {finding.margin:g}")

    @promise
    def the_same_trace_gives_the_same_findings(self) -> None:
        """Given the same trace and case then the same findings: no clock, no chance, nothing remembered."""
        first = self.findings(sketch(DRIVE), sketch_case(CASE), "a drive")
        self.findings(sketch(STANDS), sketch_case(CASE), "a robot that stands")
        demand(
            self.findings(sketch(DRIVE), sketch_case(CASE), "a drive") == first, "the same drive is judged otherwise"
        )

    @promise
    def a_trace_is_not_changed(self) -> None:
        """Given a trace then it is not changed: other criteria judge it, too."""
        trace, case = sketch(DRIVE), sketch_case(CASE)
        before = copy.deepcopy((trace, case))
        self.findings(trace, case, "a drive")
        demand(repr((trace, case)) == repr(before), "the trace is not what it was")

    @promise
    def its_horizon_and_range_are_numbers(self) -> None:
        """Given a criterion then its horizon (s) and clearance range (m) are finite and not negative."""
        for what in ("horizon", "clearance_range"):
            value = heard(f"is asked for its {what}", getattr, self.spec, what)
            demand(isinstance(value, float | int) and math.isfinite(value) and value >= 0, f"has a {what} of {value!r}")
