"""Contracts of criteria and metrics: checks that each of them must pass."""

from __future__ import annotations

import copy
import math
from typing import Any

from simscen.core.records.case import Case
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Evidence, Finding, Status
from simscen.criteria.base import Criterion
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CASE: dict[str, Any] = {"goals": [{"name": "shelf", "pose": [2.5, 0.5, 0]}], "shortest": {"shelf": 2.5}}
DRIVE_TRACE: dict[str, Any] = {
    "seconds": 8,
    "truth": [[0, 0.2, -0.1, 2.8], [4, 2, 0.5, -2.8], [8, 2.5, 0.5, 0.2]],
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
"""Descriptions for `synthetic_case` and `synthetic_trace`: one goal, and a drive to this goal.

The drive does not start at the origin, and the yaw passes ±π. A component that normalizes poses in place therefore
changes the trace, which a promise forbids.
"""
STATIONARY_TRACE: dict[str, Any] = {"seconds": 2, "truth": [[0, 0, 0]], "belief": None, "scans": []}
TRUNCATED_TRACE: dict[str, Any] = {**DRIVE_TRACE, "seconds": 3, "ended": None, "events": DRIVE_TRACE["events"][:2]}
TRACES = {
    "a drive": DRIVE_TRACE,
    "the trace of a stationary robot": STATIONARY_TRACE,
    "a truncated log": TRUNCATED_TRACE,
}
"""Descriptions of all traces (recorded states of runs), by name in messages."""


class CriterionContract(Contract):
    """Contract of a criterion, checked on all TRACES."""

    role = "criterion"

    def findings(self, trace: Trace, case: Case, label: str) -> list[Finding]:
        """Return the findings (checked bounds) of the criterion. `label` is the name of the trace in messages.

        Raises PromiseBroken unless the result is a list of findings.
        """
        criterion: Criterion = self.spec
        findings = call_component(f"judges {label}", criterion.judge, trace, case)
        is_valid = isinstance(findings, list) and all(isinstance(f, Finding) for f in findings)
        require(is_valid, f"returns {findings!r} for {label}, not a list of findings")
        return findings

    @promise
    def every_trace_yields_a_finding(self) -> None:
        """Given any trace then there is at least one finding."""
        for label, description in TRACES.items():
            findings = self.findings(synthetic_trace(description), synthetic_case(CASE), label)
            require(findings, f"returns no finding for {label}, so it checks nothing")
            for finding in findings:
                require(isinstance(finding.status, Status), f"has the status {finding.status!r}")
                require(finding.what or finding.limit, f"does not say what it checked: {finding}")

    @promise
    def a_margin_has_the_sign_of_the_status(self) -> None:
        """Given a finding that passes then its margin is not negative; of a finding that fails, it is negative."""
        for label, description in TRACES.items():
            for finding in self.findings(synthetic_trace(description), synthetic_case(CASE), label):
                if finding.margin is None or finding.status not in (Status.PASS, Status.FAIL):
                    continue
                require(not math.isnan(finding.margin), f"returns a margin of nan for {label}")
                passes = finding.status is Status.PASS
                require(passes == (finding.margin >= 0), f"{finding.status.value} with a margin of {finding.margin:g}")

    @promise
    def the_same_trace_gives_the_same_findings(self) -> None:
        """Given the same trace and case then the findings are the same, independent of clocks and earlier calls."""
        first = self.findings(synthetic_trace(DRIVE_TRACE), synthetic_case(CASE), "a drive")
        self.findings(synthetic_trace(STATIONARY_TRACE), synthetic_case(CASE), "the trace of a stationary robot")
        require(
            self.findings(synthetic_trace(DRIVE_TRACE), synthetic_case(CASE), "a drive") == first,
            "returns different findings for the same drive",
        )

    @promise
    def a_trace_is_not_changed(self) -> None:
        """Given a trace and a case then both are not changed, because other criteria use them as well."""
        trace, case = synthetic_trace(DRIVE_TRACE), synthetic_case(CASE)
        before = copy.deepcopy((trace, case))
        self.findings(trace, case, "a drive")
        require(repr((trace, case)) == repr(before), "changes the trace")

    @promise
    def its_horizon_and_range_are_numbers(self) -> None:
        """Given a criterion then its horizon (s) and clearance range (m) are finite and not negative."""
        for name in ("horizon", "clearance_range"):
            value = call_component(f"returns its {name}", getattr, self.spec, name)
            require(
                isinstance(value, float | int) and math.isfinite(value) and value >= 0, f"has a {name} of {value!r}"
            )


class MetricContract(Contract):
    """Contract of a metric, checked on all TRACES."""

    role = "metric"

    def measure(self, description: dict[str, Any], label: str) -> float | str:
        """Return the value of the metric, or why it is undefined. `label` is the name of the trace in messages."""
        value: float | str = call_component(
            f"measures {label}", self.spec.measure, synthetic_trace(description), synthetic_case(CASE)
        )
        return value

    @promise
    def it_returns_a_finite_number_or_a_reason(self) -> None:
        """Given any trace then the result is a finite number, or a text with the reason why there is no number."""
        for label, description in TRACES.items():
            value = self.measure(description, label)
            if isinstance(value, str):
                require(value, f"gives no reason why there is no number for {label}")
            else:
                is_valid = isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)
                require(is_valid, f"returns {value!r} for {label}")

    @promise
    def the_same_trace_gives_the_same_number(self) -> None:
        """Given the same trace and case then the number is the same, independent of clocks and earlier calls."""
        first = self.measure(DRIVE_TRACE, "a drive")
        self.measure(STATIONARY_TRACE, "the trace of a stationary robot")
        require(self.measure(DRIVE_TRACE, "a drive") == first, "returns different numbers for the same drive")

    @promise
    def a_trace_is_not_changed(self) -> None:
        """Given a trace and a case then both are not changed, because criteria use them as well."""
        trace, case = synthetic_trace(DRIVE_TRACE), synthetic_case(CASE)
        before = copy.deepcopy((trace, case))
        call_component("measures a drive", self.spec.measure, trace, case)
        require(repr((trace, case)) == repr(before), "changes the trace")

    @promise
    def it_has_a_unit_and_valid_evidence(self) -> None:
        """Given a metric then its unit is a text, and its evidence (required data) is None or a set of Evidence."""
        require(isinstance(self.spec.unit, str), f"has the unit {self.spec.unit!r}")
        evidence = call_component("returns its evidence", getattr, self.spec, "evidence")
        is_valid = evidence is None or all(isinstance(each, Evidence) for each in evidence)
        require(is_valid, f"has the evidence {evidence!r}, not a set of Evidence")
