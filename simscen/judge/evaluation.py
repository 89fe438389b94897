"""Evaluates all criteria of a run, each independently of the others."""

import math
from collections.abc import Sequence
from dataclasses import replace

from simscen.core.records.case import Case
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import (
    COMPLETE_COVERAGE,
    Evidence,
    ExpectedFailure,
    Finding,
    LogCoverage,
    Status,
    Verdict,
)
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, held, missed, undecided
from simscen.criteria.registry import AnyCriterion, verdict_names
from simscen.criteria.timeline import has_ended
from simscen.judge.finding_text import DISTURBANCE

_STATUSES = (Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR)


def judge(
    criteria: Sequence[AnyCriterion], trace: Trace, case: Case, coverage: LogCoverage = COMPLETE_COVERAGE
) -> tuple[Verdict, ...]:
    """Return one verdict for each criterion, in order.

    A criterion that raises an exception gets the status error; the others are not affected. A criterion whose evidence
    is missing is inconclusive. Nothing passes on a truncated log, on an empty one, or with evidence that
    covers only a part of the run, because the rest might have failed.
    """
    return tuple(
        Verdict(entry.kind, name, entry.severity, _findings(entry, trace, case, coverage))
        for entry, name in zip(criteria, verdict_names(criteria), strict=True)
    )


def outcome_of_verdicts(verdicts: Sequence[Verdict]) -> Outcome:
    """Return the outcome of a completed run.

    Only verdicts of severity `fail` can fail the run, and inconclusive counts as failed. An error of any criterion,
    whatever its severity, makes the run an error; so does a run without any verdict.
    """
    if not verdicts or any(verdict.status is Status.ERROR for verdict in verdicts):
        return Outcome.ERROR
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    return Outcome.PASSED if all(verdict.status is Status.PASS for verdict in decisive) else Outcome.FAILED


def required_evidence(entry: AnyCriterion) -> frozenset[Evidence]:
    """Return the evidence that a criterion needs; all evidence if it does not declare any."""
    own = getattr(entry.chosen, "evidence", None)
    return frozenset(Evidence) if own is None else frozenset(own)


def missing_evidence_finding(entry: AnyCriterion, coverage: LogCoverage) -> Finding | None:
    """Return the finding of a criterion whose evidence is missing; None if it can be judged."""
    missing = coverage.lacking(required_evidence(entry))
    if not missing:
        return None
    because = f"the log lacks {' and '.join(evidence.value for evidence in missing)}"
    reasons = dict.fromkeys(reason for evidence in missing if (reason := coverage.missing[evidence]))
    return Finding(Status.INCONCLUSIVE, entry.kind, because, "", detail=tuple(reasons))


def partial_evidence_reason(entry: AnyCriterion, coverage: LogCoverage) -> str:
    """Return why a pass is not proven: its evidence covers only a part of the run; "" if it is complete."""
    required = required_evidence(entry)
    return "; ".join(dict.fromkeys(reason for evidence, reason in coverage.partial.items() if evidence in required))


def findings_defect(findings: object) -> str:
    """Return what is wrong with the findings that a criterion returned; "" if they are valid.

    A plugin can return a margin that is not a number or contradicts the status, which must not become a verdict.
    """
    if not isinstance(findings, Sequence) or not findings:
        return "it checked nothing"
    return next((defect for finding in findings if (defect := _defect(finding))), "")


def _findings(entry: AnyCriterion, trace: Trace, case: Case, coverage: LogCoverage) -> tuple[Finding, ...]:
    criterion = entry.chosen
    assert isinstance(criterion, Criterion)
    try:
        if (missing := missing_evidence_finding(entry, coverage)) is not None:
            return (missing,)
        findings = criterion.judge(trace, case)
    except MissingEvidence as missing_evidence:
        return (undecided(entry.kind, str(missing_evidence)),)
    except Exception as error:  # the boundary: one criterion must not affect the others
        return (_error(entry, f"{type(error).__name__}: {error}"),)
    if defect := findings_defect(findings):
        return (_error(entry, defect),)
    if not has_ended(trace):
        return _without_pass(findings, f"so far, but the log stops at t = {trace.seconds(trace.end):.2f} s")
    if reason := partial_evidence_reason(entry, coverage):
        return _without_pass(findings, f"so far, but {reason}")
    return _without_pass(findings, "in an empty log") if _is_empty(trace) else tuple(findings)


def _error(entry: AnyCriterion, what: str) -> Finding:
    """Return the finding of a criterion that could not judge; a plugin is named with its package."""
    return Finding(Status.ERROR, entry.kind, f"{what}{entry.added_by}", "a judgment")


def _without_pass(findings: Sequence[Finding], because: str) -> tuple[Finding, ...]:
    """Return the findings with each pass turned into inconclusive."""
    return tuple(
        replace(finding, status=Status.INCONCLUSIVE, measured=f"{finding.measured} {because}")
        if finding.status is Status.PASS
        else finding
        for finding in findings
    )


def _is_empty(trace: Trace) -> bool:
    """Return True if nothing was recorded but the end of the run."""
    signals = (trace.truth, trace.belief, trace.odometry, trace.command)
    return not any(map(len, signals)) and all(event.kind == EventKind.RUN_ENDED for event in trace.events)


def _defect(finding: object) -> str:
    if not isinstance(finding, Finding) or finding.status not in _STATUSES:
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
    if (margin < 0) is not (status is Status.FAIL):
        return f"{what} has the status {status.value} but a margin of {margin:g}"
    if math.isinf(margin) and (finding.value is None or math.isfinite(finding.value)):
        return f"the margin of {what} is infinite, so its limit is not finite"
    return ""


EXPECTED = "expected"
"""Name of the verdict on an expected failure."""


def apply_expectation(
    expected: ExpectedFailure | None, verdicts: Sequence[Verdict], outcome: Outcome, is_complete: bool
) -> tuple[Outcome, Verdict | None]:
    """Return the outcome of a run that is `expected` to fail, and the verdict on this expectation.

    Without an expectation, this is the `outcome` of the run and None.

    This is strict like pytest's `xfail(strict=True)`: an expected failure that passes is a failure, and so is any other
    failed criterion. A run that could not be completed, or whose log is truncated, is never as expected. A missing
    disturbance is only expected if its name is listed.
    """
    if expected is None or outcome is Outcome.ERROR or not is_complete:
        return outcome, None
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    covered = [verdict for verdict in decisive if _is_expected_to_fail(verdict, expected)]
    failed = [verdict for verdict in covered if verdict.status is Status.FAIL]
    excused = [verdict for verdict in covered if verdict.status is not Status.PASS]
    unexpected = [verdict for verdict in covered if verdict.status is Status.PASS] if expected.criteria else []
    limit = f"a failure: {expected.reason}"
    name = EXPECTED if all(verdict.id != EXPECTED for verdict in verdicts) else f"{EXPECTED}#2"
    if unexpected or not failed:
        measured = f"{_names(unexpected)} passed" if unexpected else _nothing_failed(covered)
        return Outcome.FAILED, Verdict(EXPECTED, name, "fail", (missed(EXPECTED, measured, limit),))
    others = [verdict for verdict in decisive if verdict.status is not Status.PASS and verdict not in excused]
    verdict = Verdict(EXPECTED, name, "fail", (held(EXPECTED, f"{_names(failed)} failed", limit),))
    return (Outcome.FAILED if others else Outcome.FAILED_AS_EXPECTED), verdict


def _is_expected_to_fail(verdict: Verdict, expected: ExpectedFailure) -> bool:
    return verdict.id in expected.criteria if expected.criteria else verdict.criterion != DISTURBANCE


def _nothing_failed(verdicts: Sequence[Verdict]) -> str:
    undecided_verdicts = [verdict for verdict in verdicts if verdict.status is not Status.PASS]
    return f"nothing failed, {_names(undecided_verdicts)} undecided" if undecided_verdicts else "everything passed"


def _names(verdicts: Sequence[Verdict]) -> str:
    return ", ".join(verdict.id for verdict in verdicts)
