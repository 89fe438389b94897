"""Tests of expected failures."""

import pytest

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import ExpectedFailure, Finding, Status, Verdict
from simscen.judge.finding_text import DISTURBANCE
from simscen.judge.outcome import apply_expectation, outcome_of_verdicts

PASS, FAIL, UNCLEAR, ERROR = Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR


def verdict(name: str, status: Status, criterion: str = "", severity: str = "fail") -> Verdict:
    return Verdict(criterion or name, name, severity, (Finding(status, name, "1", "2"),))


def judged(
    expected: ExpectedFailure | None, *verdicts: Verdict, whole: bool = True, happened: tuple[str, ...] = ()
) -> tuple[Outcome, str]:
    """Return the outcome, and the measured text of the verdict on the expectation."""
    outcome, verdict_on_it = apply_expectation(expected, verdicts, outcome_of_verdicts(verdicts), whole, happened)
    return outcome, "" if verdict_on_it is None else verdict_on_it.findings[0].measured


KNOWN = ExpectedFailure("NAV-1")
SPEED = ExpectedFailure("NAV-1", ("speed",))


@pytest.mark.parametrize(
    ("expected", "statuses", "outcome", "text"),
    [
        (KNOWN, (FAIL, PASS), Outcome.FAILED_AS_EXPECTED, "speed failed"),
        (KNOWN, (FAIL, FAIL), Outcome.FAILED_AS_EXPECTED, "speed, clearance failed"),
        (KNOWN, (FAIL, UNCLEAR), Outcome.FAILED_AS_EXPECTED, "speed failed"),
        (KNOWN, (PASS, PASS), Outcome.FAILED, "everything passed"),
        (KNOWN, (PASS, UNCLEAR), Outcome.FAILED, "nothing failed, clearance undecided"),
        (KNOWN, (FAIL, ERROR), Outcome.ERROR, ""),
        (SPEED, (FAIL, PASS), Outcome.FAILED_AS_EXPECTED, "speed failed"),
        (SPEED, (FAIL, FAIL), Outcome.FAILED, "speed failed"),
        (SPEED, (FAIL, UNCLEAR), Outcome.FAILED, "speed failed"),
        (SPEED, (PASS, FAIL), Outcome.FAILED, "speed passed"),
        (SPEED, (PASS, PASS), Outcome.FAILED, "speed passed"),
        (SPEED, (UNCLEAR, PASS), Outcome.FAILED, "nothing failed, speed undecided"),
        (None, (FAIL, PASS), Outcome.FAILED, ""),
        (None, (PASS, PASS), Outcome.PASSED, ""),
    ],
)
def test_exactly_the_expected_criteria_must_fail(
    expected: ExpectedFailure | None, statuses: tuple[Status, Status], outcome: Outcome, text: str
) -> None:
    verdicts = [verdict(name, status) for name, status in zip(("speed", "clearance"), statuses, strict=True)]
    assert judged(expected, *verdicts) == (outcome, text)


def test_all_named_criteria_must_fail() -> None:
    both = ExpectedFailure("NAV-1", ("speed", "clearance"))
    assert judged(both, verdict("speed", FAIL), verdict("clearance", PASS)) == (Outcome.FAILED, "clearance passed")


def test_a_disturbance_that_did_not_happen_is_expected_only_by_its_name() -> None:
    missing = verdict("door", FAIL, DISTURBANCE)
    assert judged(KNOWN, missing, verdict("speed", FAIL)) == (Outcome.FAILED, "speed failed")
    assert judged(KNOWN, missing, verdict("speed", PASS)) == (Outcome.FAILED, "everything passed")
    assert judged(ExpectedFailure("NAV-1", ("door",)), missing)[0] is Outcome.FAILED_AS_EXPECTED


@pytest.mark.parametrize(
    ("happened", "statuses", "outcome", "text"),
    [
        ((), (FAIL, PASS), Outcome.FAILED_AS_EXPECTED, "speed failed"),
        (("lift",), (FAIL, PASS), Outcome.FAILED_AS_EXPECTED, "speed failed"),
        (("door",), (FAIL, PASS), Outcome.FAILED, "door happened"),
        (("door",), (PASS, PASS), Outcome.FAILED, "speed passed, door happened"),
    ],
)
def test_named_disturbance_must_not_happen(
    happened: tuple[str, ...], statuses: tuple[Status, Status], outcome: Outcome, text: str
) -> None:
    expected = ExpectedFailure("NAV-1", ("speed", "door"))
    verdicts = [verdict(name, status) for name, status in zip(("speed", "clearance"), statuses, strict=True)]
    assert judged(expected, *verdicts, happened=happened) == (outcome, text)


def test_named_disturbance_may_happen_if_another_of_the_same_name_does_not() -> None:
    missing = verdict("lidar.off", FAIL, DISTURBANCE)
    named = ExpectedFailure("NAV-1", ("lidar.off",))
    assert judged(named, missing, happened=("lidar.off",))[0] is Outcome.FAILED_AS_EXPECTED


def test_a_warning_is_no_failure_to_expect() -> None:
    verdicts = verdict("speed", FAIL, severity="warn"), verdict("clearance", PASS)
    assert judged(KNOWN, *verdicts) == (Outcome.FAILED, "everything passed")


def test_truncated_log_never_fails_as_expected() -> None:
    assert judged(KNOWN, verdict("speed", FAIL), verdict("clearance", UNCLEAR), whole=False) == (Outcome.FAILED, "")


@pytest.mark.parametrize(
    ("ids", "name"),
    [
        ((), "expected"),
        (("speed",), "expected"),
        (("expected", "speed"), "expected#2"),
        (("expected", "expected#2"), "expected#3"),
    ],
)
def test_verdict_on_the_expectation_has_a_unique_name(ids: tuple[str, ...], name: str) -> None:
    verdicts = [verdict(each, FAIL) for each in ids]
    _, verdict_on_it = apply_expectation(KNOWN, verdicts, Outcome.FAILED, True)
    assert verdict_on_it is not None
    assert verdict_on_it.id == name
