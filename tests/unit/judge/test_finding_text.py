"""Tests of the texts of verdicts and disturbances, and of margins relative to their limits."""

import math
from dataclasses import replace

import pytest

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import (
    disturbance_line,
    disturbance_times,
    relative_margin,
    run_margin,
    sentence,
    tightest_margin,
    violations,
)


def verdict(finding, kind="stopped_within", name="stopped_within"):
    return Verdict(kind, name, "fail", (finding,))


STOP = Finding(
    Status.FAIL, "stopped_within", "0.84 s", "≤ 0.50 s after lidar.off", -0.34, "s", 0.84, 10 * 240 + 202, (2.1, 3.41)
)


def test_failed_verdict_has_the_documented_format():
    expected = "stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)"
    assert sentence(verdict(STOP), STOP, 240) == expected


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (Finding(Status.PASS, "clearance", "0.20 m", "≥ 0.10 m"), "clearance: 0.20 m ≥ 0.10 m"),
        (Finding(Status.FAIL, "clearance", "0.05 m", "≥ 0.10 m"), "clearance: 0.05 m < 0.10 m"),
        (Finding(Status.FAIL, "result", "FAILED", "SUCCEEDED"), "clearance: result: FAILED; expected SUCCEEDED"),
        (Finding(Status.PASS, "result", "FAILED", "FAILED"), "clearance: result: FAILED"),
        (Finding(Status.INCONCLUSIVE, "clearance", "nothing", "≥ 0.10 m"), "clearance: inconclusive: nothing"),
        (Finding(Status.FAIL, "clearance ratio", "2", "≤ 1"), "clearance: ratio: 2 > 1"),
    ],
)
def test_every_status_has_its_sentence(finding, text):
    assert sentence(verdict(finding, "clearance", "clearance"), finding, 240) == text


def test_tightest_bound_has_the_smallest_relative_margin():
    loose = Finding(Status.PASS, "time_to_goal", "", "≤ 40.00 s", 4.0, "s", 36.0)
    tight = Finding(Status.PASS, "path_length", "", "≤ 10.00 m", 0.14, "m", 9.86)
    count = Finding(Status.PASS, "collisions", "", "≤ 0", 0.0, "", 0.0)
    verdicts = [
        verdict(loose, "time_to_goal", "t"),
        verdict(tight, "path_length", "path_length"),
        verdict(count, "c", "c"),
    ]
    assert tightest_margin(verdicts) == "path_length +0.14 m, 1 % of its limit"
    assert tightest_margin([]) == ""


def test_pose_and_duration_at_a_goal_are_never_the_tightest_bound():
    stopped = Finding(Status.PASS, "goal dock", "", "≤ 0.25 m from the goal", 0.01, "m", 0.24)
    turned = Finding(Status.PASS, "goal dock heading", "", "≤ 0.25 rad from the goal's heading", 0.01, "rad", 0.24)
    waited = Finding(Status.PASS, "goal dock wait", "", "≥ 3.00 s", 0.0, "s", 3.0)
    within = Finding(Status.PASS, "goal dock time", "", "≤ 20.00 s", 15.0, "s", 5.0)
    assert tightest_margin([Verdict("goals_reached", "g", "fail", (stopped, turned, waited))]) == ""
    text = tightest_margin([Verdict("goals_reached", "g", "fail", (stopped, turned, waited, within))])
    assert text == "g: goal dock time +15.00 s, 75 % of its limit"


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (Finding(Status.PASS, "own", "", "≤ 0.00 m/s", 0.2, "m/s", -0.2), "own +0.20 m/s"),
        (Finding(Status.PASS, "own", "", "≥ 0.10 m", 0.3, "m", 0.4), "own +0.30 m, 300 % of its limit"),
        (Finding(Status.PASS, "own", "", "in the yard", 0.3, "m"), "own +0.30 m"),
        (Finding(Status.PASS, "own", "", "≥ 0.10 m", float("inf"), "m", float("inf")), ""),
    ],
    ids=["limit zero", "at least", "without a measured text", "infinite"],
)
def test_margin_is_reported_as_a_share_if_possible(finding, text):
    assert tightest_margin([verdict(finding, "own", "own")]) == text


def bound(limit, margin, value):
    return verdict(Finding(Status.PASS, "own", "", limit, margin, "m", value), limit, limit)


@pytest.mark.parametrize(
    ("tight", "loose"),
    [
        (bound("≤ 10", 0.95, 9.05), bound("≥ 1", 0.1, 1.1)),
        (bound("≤ 10", 0.0, 10.0), bound("≤ 9", 0.01, 8.99)),
        (bound("≤ 5", 4.9, 0.1), bound("≤ 6", 6.0, 0.0)),
        (bound("≥ 1", 0.005, 1.005), bound("≥ -10", 0.1, -9.9)),
        (bound("≥ 0", 0.05, 0.05), bound("≤ 1", 0.1, 0.9)),
    ],
    ids=["of either direction", "met to the bit", "with nothing used of it", "below zero", "of zero"],
)
def test_bounds_are_compared_by_relative_margin(tight, loose):
    for verdicts in ([tight, loose], [loose, tight]):
        assert tightest_margin(verdicts).startswith(tight.id)


def test_verdict_lists_all_findings_that_did_not_pass():
    passed, undecided = Finding(Status.PASS, "a", "", ""), Finding(Status.INCONCLUSIVE, "b", "", "")
    assert violations(Verdict("result", "result", "fail", (passed, STOP, undecided))) == (STOP, undecided)


@pytest.mark.parametrize(
    ("ticks", "text"),
    [
        ((), "never"),
        ((240, 600), "t = 1.00 s, 2.50 s"),
        ((0, 240, 480, 720, 960), "t = 0.00 s, 1.00 s, 2.00 s, 3.00 s, 4.00 s"),
        ((0, 240, 480, 720, 960, 1200, 1440), "t = 0.00 s, 1.00 s, 2.00 s, 3.00 s, 4.00 s and 2 more"),
    ],
)
def test_first_five_times_are_listed(ticks, text):
    assert disturbance_times(DisturbanceOutcome(Disturbance("gust", "event"), ticks, True, ""), 240) == text


@pytest.mark.parametrize(
    ("ticks", "happened", "text"),
    [
        ((2400,), True, "gust: t = 10.00 s, pushed it"),
        ((2400,), False, "gust: t = 10.00 s, pushed it, so it did not happen"),
        ((), False, "gust: pushed it, so it did not happen"),
    ],
)
def test_a_disturbance_is_reported_in_a_line(ticks, happened, text):
    assert disturbance_line(DisturbanceOutcome(Disturbance("gust", "event"), ticks, happened, "pushed it"), 240) == text


def margin_of_run(outcome: Outcome, *findings: Finding) -> float:
    verdicts = tuple(Verdict(finding.what, finding.what, "fail", (finding,)) for finding in findings)
    error = RunFailure("stack-crashed", "gone", by_stack=True) if outcome is Outcome.ERROR else None
    return run_margin(RunResult(RunKey("a", 1), "a", outcome, verdicts, error=error))


def bounded_finding(
    status: Status, value: float, limit: float, relation: str = "≥", what: str = "clearance"
) -> Finding:
    margin = value - limit if relation == "≥" else limit - value
    return Finding(status, what, "", f"{relation} {limit}", margin, "m", value)


def test_the_margin_of_a_run_is_that_of_its_tightest_criterion_relative_to_the_limit() -> None:
    tight, loose = bounded_finding(Status.PASS, 0.6, 0.4), bounded_finding(Status.PASS, 1.0, 4.0, "≤", "speed")
    assert margin_of_run(Outcome.PASSED, loose, tight) == pytest.approx(0.5)
    assert margin_of_run(Outcome.PASSED, loose) == pytest.approx(0.75)
    assert margin_of_run(Outcome.PASSED) == 1.0
    assert margin_of_run(Outcome.PASSED, replace(tight, margin=None)) == 1.0
    assert margin_of_run(Outcome.PASSED, replace(tight, margin=-1e-12)) == 0.0
    assert margin_of_run(Outcome.PASSED, replace(tight, margin=math.inf), loose) == pytest.approx(0.75)


def test_the_margin_of_a_failed_run_is_negative_and_at_least_minus_one() -> None:
    passed = bounded_finding(Status.PASS, 0.6, 0.5)
    assert margin_of_run(Outcome.FAILED, passed, bounded_finding(Status.FAIL, 0.3, 0.4)) == pytest.approx(-0.25)
    two = bounded_finding(Status.FAIL, 0.3, 0.4), bounded_finding(Status.FAIL, 3.0, 2.0, "≤", "speed")
    assert margin_of_run(Outcome.FAILED, *two) == pytest.approx(-0.5)
    assert margin_of_run(Outcome.FAILED, bounded_finding(Status.FAIL, 9.0, 2.0, "≤", "speed")) == -1.0
    assert margin_of_run(Outcome.FAILED, Finding(Status.FAIL, "result", "failed", "reached")) == -1.0
    assert margin_of_run(Outcome.FAILED, replace(two[0], margin=-math.inf)) == -1.0
    assert margin_of_run(Outcome.FAILED, replace(two[0], margin=0.0)) == -1.0
    assert margin_of_run(Outcome.FAILED) == -1.0
    assert margin_of_run(Outcome.ERROR) == -1.0


def test_margin_without_a_limit_is_not_scaled() -> None:
    assert relative_margin(Finding(Status.PASS, "x", "", "", 0.3, "m")) == 0.3
    assert relative_margin(Finding(Status.PASS, "x", "", "≥ 0 m", 0.3, "m", 0.3)) == 0.3
    assert relative_margin(Finding(Status.PASS, "x", "", "> -2 m", 0.5, "m", -1.5)) == 0.25


def test_margin_of_a_failed_run_ignores_infinite_margins() -> None:
    broken = bounded_finding(Status.FAIL, 0.3, 0.4)
    assert margin_of_run(Outcome.FAILED, replace(broken, margin=math.inf), broken) == pytest.approx(-0.25)
    assert margin_of_run(Outcome.FAILED, replace(broken, margin=-math.inf), broken) == pytest.approx(-0.25)
    assert margin_of_run(Outcome.FAILED, replace(broken, margin=0.1, value=0.5), broken) == pytest.approx(-0.25)


def test_margin_in_multiples_of_a_scale_is_a_relative_margin() -> None:
    """A `scale` of the conditions of temporal criteria makes margins of different quantities comparable."""
    scaled = Finding(Status.PASS, "speed", "0.25 m/s", "≤ 0.50 m/s", 0.25)
    count = Finding(Status.PASS, "collisions", "0 collisions", "≤ 0", 0.0, "", 0.0)
    assert margin_of_run(Outcome.PASSED, scaled, count, bounded_finding(Status.PASS, 0.6, 0.4)) == pytest.approx(0.25)
    failed = Finding(Status.FAIL, "speed", "0.75 m/s", "≤ 0.50 m/s", -0.25)
    assert margin_of_run(Outcome.FAILED, failed) == pytest.approx(-0.25)
