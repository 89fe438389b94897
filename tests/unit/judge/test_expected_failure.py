"""Tests of expected failures."""

import pytest

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import ExpectedFailure, Finding, Status, Verdict
from simscen.judge.finding_text import DISTURBANCE
from simscen.judge.outcome import apply_expectation, outcome_of_verdicts

PASS, FAIL, UNCLEAR, ERROR = Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR


def verdict(name: str, status: Status, criterion: str = "", severity: str = "fail") -> Verdict:
    return Verdict(criterion or name, name, severity, (Finding(status, name, "1", "2"),))


def outcome_and_text(
    expected: ExpectedFailure | None, *verdicts: Verdict, is_complete: bool = True, happened: tuple[str, ...] = ()
) -> tuple[Outcome, str]:
    """Return the outcome, and the measured text of the verdict on the expectation."""
    outcome, expectation_verdict = apply_expectation(
        expected, verdicts, outcome_of_verdicts(verdicts), is_complete, happened
    )
    return outcome, "" if expectation_verdict is None else expectation_verdict.findings[0].measured


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
    assert outcome_and_text(expected, *verdicts) == (outcome, text)


def test_all_named_criteria_must_fail() -> None:
    both = ExpectedFailure("NAV-1", ("speed", "clearance"))
    assert outcome_and_text(both, verdict("speed", FAIL), verdict("clearance", PASS)) == (
        Outcome.FAILED,
        "clearance passed",
    )


def test_a_disturbance_that_did_not_happen_is_expected_only_by_its_name() -> None:
    missing = verdict("door", FAIL, DISTURBANCE)
    assert outcome_and_text(KNOWN, missing, verdict("speed", FAIL)) == (Outcome.FAILED, "speed failed")
    assert outcome_and_text(KNOWN, missing, verdict("speed", PASS)) == (Outcome.FAILED, "everything passed")
    assert outcome_and_text(ExpectedFailure("NAV-1", ("door",)), missing)[0] is Outcome.FAILED_AS_EXPECTED


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
    assert outcome_and_text(expected, *verdicts, happened=happened) == (outcome, text)


def test_named_disturbance_may_happen_if_another_of_the_same_name_does_not() -> None:
    missing = verdict("lidar.off", FAIL, DISTURBANCE)
    expected = ExpectedFailure("NAV-1", ("lidar.off",))
    assert outcome_and_text(expected, missing, happened=("lidar.off",))[0] is Outcome.FAILED_AS_EXPECTED


def test_a_warning_is_no_failure_to_expect() -> None:
    verdicts = verdict("speed", FAIL, severity="warn"), verdict("clearance", PASS)
    assert outcome_and_text(KNOWN, *verdicts) == (Outcome.FAILED, "everything passed")


def test_truncated_log_never_fails_as_expected() -> None:
    assert outcome_and_text(KNOWN, verdict("speed", FAIL), verdict("clearance", UNCLEAR), is_complete=False) == (
        Outcome.FAILED,
        "",
    )


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
    verdicts = [verdict(id_, FAIL) for id_ in ids]
    _, expectation_verdict = apply_expectation(KNOWN, verdicts, Outcome.FAILED, True)
    assert expectation_verdict is not None
    assert expectation_verdict.id == name
