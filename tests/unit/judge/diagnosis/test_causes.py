"""Tests of the causes that are listed for failures."""

from diagnosis_cases import STATIONARY, why, with_event

from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.failure_causes import explain_failures
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def test_only_failures_have_causes_listed_before_their_details():
    trace = synthetic_trace({**STATIONARY, "events": with_event("gust", 9)})
    failed = Finding(Status.FAIL, "speed", "2", "≤ 1", tick=2400, detail=("own",))
    findings = (failed, Finding(Status.PASS, "speed", "0", "≤ 1", tick=2400), Finding(Status.FAIL, "speed", "2", "≤ 1"))
    (verdict,) = explain_failures([Verdict("speed", "speed", "fail", findings)], trace, synthetic_case({}))
    assert [finding.detail for finding in verdict.findings] == [
        ("meanwhile: event `gust` happened 1.00 s before: something", "own"),
        (),
        (),
    ]


def test_at_most_six_causes_are_reported():
    lines = why("speed", [event for k in range(9) for event in with_event(f"gust {k}", 9)], case={})
    assert lines == [f"meanwhile: event `gust {k}` happened 1.00 s before: something" for k in range(6)]
