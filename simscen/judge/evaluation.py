"""Evaluation of the criteria of a run: one verdict for each criterion."""

import math
from collections.abc import Sequence, Set
from dataclasses import replace

from simscen.core.errors import exception_place
from simscen.core.records.case import Case
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, Evidence, Finding, LogCoverage, Status, Verdict
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, undecided
from simscen.criteria.registry import AnyCriterion, verdict_names
from simscen.criteria.timeline import has_ended


def judge(
    criteria: Sequence[AnyCriterion], trace: Trace, case: Case, coverage: LogCoverage = COMPLETE_COVERAGE
) -> tuple[Verdict, ...]:
    """Return one verdict for each criterion, in order.

    `coverage` states which evidence the log contains, and for which part of the run. A verdict is inconclusive if the
    log lacks required evidence, or if the criterion raises MissingEvidence. Any other exception, or an invalid finding,
    gives the verdict error. A pass becomes inconclusive if the log is truncated or empty, or if the evidence covers
    only a part of the run.
    """
    return tuple(
        Verdict(entry.kind, name, entry.severity, _findings(entry, trace, case, coverage))
        for entry, name in zip(criteria, verdict_names(criteria), strict=True)
    )


def required_evidence(entry: AnyCriterion) -> frozenset[Evidence]:
    """Return the evidence (kinds of recorded information) that a criterion needs; all kinds if it declares none."""
    declared = getattr(entry.chosen, "evidence", None)
    return frozenset(Evidence) if declared is None else frozenset(declared)


def missing_evidence_reason(required: Set[Evidence], coverage: LogCoverage) -> str:
    """Return as text which required evidence the log lacks; "" if nothing is missing."""
    missing = coverage.missing_from(required)
    return f"the log lacks {' and '.join(evidence.value for evidence in missing)}" if missing else ""


def partial_evidence_reason(required: Set[Evidence], coverage: LogCoverage) -> str:
    """Return the reasons why the required evidence covers only a part of the run; "" if it covers the whole run."""
    return "; ".join(dict.fromkeys(reason for evidence, reason in coverage.partial.items() if evidence in required))


def findings_defect(findings: object) -> str:
    """Return a description of what is wrong with the findings of a criterion; "" if they are valid."""
    if not isinstance(findings, Sequence) or not findings:
        return "it returned no findings"
    return next((defect for finding in findings if (defect := _defect(finding))), "")


def _findings(entry: AnyCriterion, trace: Trace, case: Case, coverage: LogCoverage) -> tuple[Finding, ...]:
    """Return the findings of one criterion, or one finding with the reason why the criterion cannot be judged."""
    criterion, required = entry.chosen, required_evidence(entry)
    assert isinstance(criterion, Criterion)
    try:
        if reason := missing_evidence_reason(required, coverage):
            causes = dict.fromkeys(coverage.missing[evidence] for evidence in coverage.missing_from(required))
            detail = tuple(cause for cause in causes if cause)
            return (Finding(Status.INCONCLUSIVE, entry.kind, reason, "", detail=detail),)
        findings = criterion.judge(trace, case)
    except MissingEvidence as missing_evidence:
        return (undecided(entry.kind, str(missing_evidence)),)
    except Exception as error:  # the boundary: one criterion must not affect the others
        place = "" if entry.original_class is None else f", at {exception_place(error, type(criterion).__module__)}"
        return (_error(entry, f"{type(error).__name__}: {error}{place}"),)
    if defect := findings_defect(findings):
        return (_error(entry, defect),)
    if not has_ended(trace):
        return _without_pass(findings, f"so far, but the log stops at t = {trace.seconds(trace.end):.2f} s")
    if reason := partial_evidence_reason(required, coverage):
        return _without_pass(findings, f"so far, but {reason}")
    return _without_pass(findings, "in an empty log") if _is_empty(trace) else tuple(findings)


def _error(entry: AnyCriterion, message: str) -> Finding:
    """Return the finding for a criterion that could not judge the run."""
    return Finding(Status.ERROR, entry.kind, f"{message}{entry.plugin_suffix}", "a judgment")


def _without_pass(findings: Sequence[Finding], reason: str) -> tuple[Finding, ...]:
    """Return the findings. Each pass becomes inconclusive, with the reason after the measured value."""
    return tuple(
        replace(finding, status=Status.INCONCLUSIVE, measured=f"{finding.measured} {reason}")
        if finding.status is Status.PASS
        else finding
        for finding in findings
    )


def _is_empty(trace: Trace) -> bool:
    """Return whether nothing was recorded except the end of the run."""
    signals = (trace.truth, trace.belief, trace.odometry, trace.command)
    return not any(map(len, signals)) and all(event.kind == EventKind.RUN_ENDED for event in trace.events)


def _defect(finding: object) -> str:
    """Return a description of what is wrong with one finding; "" if it is valid."""
    if not isinstance(finding, Finding) or finding.status not in tuple(Status):
        return f"it returned an invalid finding of type {type(finding).__name__}"
    if not all(isinstance(text, str) for text in (finding.what, finding.measured, finding.limit, finding.unit)):
        return "a text of its finding is not a string"
    what = finding.what or "its finding"
    for name, number in (("margin", finding.margin), ("value", finding.value)):
        if number is not None and (not isinstance(number, int | float) or math.isnan(number)):
            return f"the {name} of {what} is not a number: {number!r}"
    tick: object = finding.tick
    if tick is not None and not isinstance(tick, int):
        return f"the tick of {what} is not an int: {tick!r}"
    margin, status = finding.margin, finding.status
    if margin is None or status not in (Status.PASS, Status.FAIL):
        return ""
    if (margin < 0) != (status is Status.FAIL):  # `!=`, because numpy compares to its own bool
        return f"{what} has the status {status.value} but a margin of {margin:g}"
    if math.isinf(margin) and (finding.value is None or math.isfinite(finding.value)):
        return f"the margin of {what} is infinite, so its limit is not finite"
    return ""
