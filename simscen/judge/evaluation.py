"""Every criterion answers, whatever happens to the others."""

import math
from collections.abc import Sequence
from dataclasses import replace

from simscen.core.case import Case
from simscen.core.events import EventKind
from simscen.core.evidence import WHOLE, Coverage
from simscen.core.result import Outcome
from simscen.core.trace import Trace
from simscen.core.verdict import Finding, Status, Verdict
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, undecided
from simscen.criteria.registry import AnyCriterion, verdict_names
from simscen.criteria.timeline import has_ended
from simscen.judge.required_evidence import missing_evidence_finding, partial_evidence_reason


def judge(
    criteria: Sequence[AnyCriterion], trace: Trace, case: Case, coverage: Coverage = WHOLE
) -> tuple[Verdict, ...]:
    """One verdict for each criterion, in order.

    An exception inside a criterion is its verdict, an error that names it; what it needs and was not recorded, or what
    the log lacks (`coverage`), leaves it inconclusive. On a log that was cut off nothing passes, for what came after
    might have failed, nor on an empty one.
    """
    return tuple(
        Verdict(entry.kind, name, entry.severity, _findings(entry, trace, case, coverage))
        for entry, name in zip(criteria, verdict_names(criteria), strict=True)
    )


def outcome_of_verdicts(verdicts: Sequence[Verdict]) -> Outcome:
    """The outcome of a run that came to its end.

    Only severity `fail` can fail it, and inconclusive counts as failed. A criterion that broke down makes the run an
    error whatever its severity, and so does a run that nothing judged: neither may look like a pass.
    """
    if not verdicts or any(verdict.status is Status.ERROR for verdict in verdicts):
        return Outcome.ERROR
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    return Outcome.PASSED if all(verdict.status is Status.PASS for verdict in decisive) else Outcome.FAILED


def _findings(entry: AnyCriterion, trace: Trace, case: Case, coverage: Coverage) -> tuple[Finding, ...]:
    criterion = entry.chosen
    assert isinstance(criterion, Criterion)
    try:
        if (unknown := missing_evidence_finding(entry, coverage)) is not None:
            return (unknown,)
        findings = criterion.judge(trace, case)
    except MissingEvidence as missing:
        return (undecided(entry.kind, str(missing)),)
    except Exception as error:  # the boundary: one criterion must not silence the others
        return (_broken(entry, f"{type(error).__name__}: {error}"),)
    if flaw := findings_defect(findings):
        return (_broken(entry, flaw),)
    if not has_ended(trace):
        return _reserved(findings, f"so far, but the log stops at t = {trace.seconds(trace.end):.2f} s")
    if doubts := partial_evidence_reason(entry, coverage):
        return _reserved(findings, f"so far, but {doubts}")
    return _reserved(findings, "in a log with nothing in it") if _empty(trace) else tuple(findings)


def _broken(entry: AnyCriterion, what: str) -> Finding:
    """The finding of a criterion that gave none; one of an installed package is named with it."""
    return Finding(Status.ERROR, entry.kind, f"{what}{entry.added_by}", "a judgement")


def _reserved(findings: Sequence[Finding], because: str) -> tuple[Finding, ...]:
    """The same without a pass."""
    return tuple(
        replace(finding, status=Status.INCONCLUSIVE, measured=f"{finding.measured} {because}")
        if finding.status is Status.PASS
        else finding
        for finding in findings
    )


def _empty(trace: Trace) -> bool:
    """Whether nothing was recorded but the end of the run."""
    signals = (trace.truth, trace.belief, trace.odometry, trace.command)
    return not any(map(len, signals)) and all(event.kind == EventKind.RUN_ENDED for event in trace.events)


# MERGED: Whether an answer is one: what a criterion or a metric hands over is looked at before anybody believes it.
_JUDGED = (Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR)


def findings_defect(findings: object) -> str:
    """Why a criterion's findings are no judgement; "" when they are. A number that is none could pass for a verdict."""
    if not isinstance(findings, Sequence) or not findings:
        return "it checked nothing"
    return next((flaw for finding in findings if (flaw := _flaw(finding))), "")


def _flaw(finding: object) -> str:
    if not isinstance(finding, Finding) or finding.status not in _JUDGED:
        return f"its finding is {type(finding).__name__}, which is none"
    if not all(isinstance(text, str) for text in (finding.what, finding.measured, finding.limit, finding.unit)):
        return "its finding says something that is no text"
    what = finding.what or "its finding"
    for name, number in (("margin", finding.margin), ("value", finding.value)):
        if number is not None and (not isinstance(number, int | float) or math.isnan(number)):
            return f"the {name} of {what} is no number: {number!r}"
    tick: object = finding.tick
    if tick is not None and not isinstance(tick, int):
        return f"the tick of {what} is no int: {tick!r}"
    margin, status = finding.margin, finding.status
    if margin is not None and status in (Status.PASS, Status.FAIL) and (margin < 0) is not (status is Status.FAIL):
        return f"{what} is a {status.value} by a margin of {margin:g}"
    return ""
