"""Tests of verdicts, outcomes of runs, and checks of the findings of plug-ins."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import Outcome
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.criteria.clearance import Clearance
from simscen.criteria.findings import at_least, at_most
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import findings_defect, judge
from simscen.judge.outcome import outcome_of_verdicts
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

TRACE = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": 0.5})
CASE = synthetic_case({})


def criterion(**keys):
    return AnyCriterion.model_validate(keys)


def verdict(status, severity="fail"):
    return Verdict("clearance", "clearance", severity, (Finding(status, "clearance", "", ""),))


def test_verdicts_are_in_the_order_of_the_criteria():
    verdicts = judge(
        [
            criterion(clearance={"min": 0.1}),
            criterion(clearance={"min": 0.9}, id="far", severity="warn"),
            criterion(clearance={"min": 0.2}),
        ],
        TRACE,
        CASE,
    )
    assert [(v.id, v.severity, v.status) for v in verdicts] == [
        ("clearance", "fail", Status.PASS),
        ("far", "warn", Status.FAIL),
        ("clearance#2", "fail", Status.PASS),
    ]


def test_exception_in_a_criterion_is_an_error_verdict_for_this_criterion_only(monkeypatch):
    monkeypatch.setattr(Clearance, "judge", lambda *_: 1 / 0)
    clearance, collisions = judge([criterion(clearance={"min": 0.1}), criterion(collisions={})], TRACE, CASE)
    assert clearance.status is Status.ERROR
    assert clearance.findings[0].measured == "ZeroDivisionError: division by zero"
    assert collisions.status is Status.PASS


def test_criterion_without_findings_is_an_error(monkeypatch):
    monkeypatch.setattr(Clearance, "judge", lambda *_: [])
    (empty,) = judge([criterion(clearance={"min": 0.1})], TRACE, CASE)
    assert empty.status is Status.ERROR


@pytest.mark.parametrize(
    ("finding", "defect"),
    [
        (at_least("value", 0.3, -math.inf, "m"), "the margin of value is infinite, so its limit is not finite"),
        (at_most("value", 0.3, math.inf, "m"), "the margin of value is infinite, so its limit is not finite"),
        (at_least("value", 0.3, math.inf, "m"), "the margin of value is infinite, so its limit is not finite"),
        (
            Finding(Status.PASS, "value", "", "", math.inf),
            "the margin of value is infinite, so its limit is not finite",
        ),
        (at_least("value", math.inf, 0.3, "m"), ""),
        (at_most("value", -math.inf, 0.3, "m"), ""),
        (at_least("value", 0.3, 0.1, "m"), ""),
    ],
)
def test_limit_that_cannot_be_violated_is_a_defect(finding, defect):
    assert findings_defect([finding]) == defect


@pytest.mark.parametrize(
    ("verdicts", "expected"),
    [
        ([verdict(Status.PASS)], Outcome.PASSED),
        ([verdict(Status.PASS), verdict(Status.FAIL)], Outcome.FAILED),
        ([verdict(Status.PASS), verdict(Status.INCONCLUSIVE)], Outcome.FAILED),
        ([verdict(Status.PASS), verdict(Status.FAIL, "warn")], Outcome.PASSED),
        ([verdict(Status.PASS), verdict(Status.INCONCLUSIVE, "warn")], Outcome.PASSED),
        ([verdict(Status.FAIL), verdict(Status.ERROR)], Outcome.ERROR),
        ([verdict(Status.PASS), verdict(Status.ERROR, "warn")], Outcome.ERROR),
        ([], Outcome.ERROR),
    ],
)
def test_warnings_do_not_fail_a_run_but_errors_in_warnings_do(verdicts, expected):
    assert outcome_of_verdicts(verdicts) is expected


def without_signals(trace):
    empty = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    return replace(trace, truth=empty, velocity=empty, belief=empty, odometry=empty, command=empty)


def test_log_without_signals_and_events_does_not_pass():
    criteria = [criterion(recoveries={"max": 5})]
    (empty,) = judge(criteria, without_signals(TRACE), CASE)
    assert empty.status is Status.INCONCLUSIVE
    assert empty.findings[0].measured == "0 recoveries in an empty log"
    accepted = Event(5, EventKind.GOAL_ACCEPTED, "a")
    (with_event,) = judge(criteria, replace(without_signals(TRACE), events=(accepted, *TRACE.events)), CASE)
    assert with_event.status is Status.PASS
    (with_truth,) = judge(criteria, replace(without_signals(TRACE), truth=TRACE.truth), CASE)
    assert with_truth.status is Status.PASS


GOOD = Finding(Status.PASS, "value", "1 m", "≥ 0 m", 1.0, "m", 1.0)


@pytest.mark.parametrize(
    ("findings", "defect"),
    [
        (None, "it returned no findings"),
        ([], "it returned no findings"),
        ({GOOD}, "it returned no findings"),
        ((GOOD for _ in range(1)), "it returned no findings"),
        ([GOOD, "fine"], "it returned an invalid finding of type str"),
        ([replace(GOOD, status="pass?")], "it returned an invalid finding of type Finding"),
        ([replace(GOOD, what=1)], "a text of its finding is not a string"),
        ([replace(GOOD, measured=None)], "a text of its finding is not a string"),
        ([replace(GOOD, limit=2)], "a text of its finding is not a string"),
        ([replace(GOOD, unit=3)], "a text of its finding is not a string"),
        ([replace(GOOD, margin="1")], "the margin of value is not a number: '1'"),
        ([replace(GOOD, margin=math.nan)], "the margin of value is not a number: nan"),
        ([replace(GOOD, value=math.nan)], "the value of value is not a number: nan"),
        ([replace(GOOD, what="", value="x")], "the value of its finding is not a number: 'x'"),
        ([GOOD, replace(GOOD, margin=None, value=None)], ""),
    ],
)
def test_findings_of_plug_ins_are_checked(findings: object, defect: str) -> None:
    assert findings_defect(findings) == defect


@pytest.mark.parametrize(("margin", "status"), [(0.5, Status.PASS), (-0.5, Status.FAIL)])
def test_a_margin_may_be_a_number_of_numpy(margin, status):
    assert findings_defect([Finding(status, "speed", "1", "≤ 2", np.float64(margin))]) == ""
    assert "a margin of" in findings_defect([Finding(status, "speed", "1", "≤ 2", np.float64(-margin))])
