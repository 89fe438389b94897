"""A run that is known to fail: as expected it is no failure, and anything else it does is one."""

from collections.abc import Sequence

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import ExpectedFailure, Status, Verdict
from simscen.criteria.findings import held, missed
from simscen.judge.finding_text import DISTURBANCE

EXPECTED = "expected"
"""What the verdict on an expectation is called."""


def apply_expectation(
    expected: ExpectedFailure | None, verdicts: Sequence[Verdict], came_out: Outcome, whole: bool
) -> tuple[Outcome, Verdict | None]:
    """The outcome of a run that is `expected` to fail, and the verdict on that; the run's own where nothing is.

    Strict, as pytest's xfail can be: everything that holds although it was expected to fail is a failure, and so is
    what fails besides. A run that could not be completed, or whose log is not `whole`, is never as expected. What had
    to happen and did not is expected only by its name.
    """
    if expected is None or came_out is Outcome.ERROR or not whole:
        return came_out, None
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    meant = [verdict for verdict in decisive if _is_meant(verdict, expected)]
    failed = [verdict for verdict in meant if verdict.status is Status.FAIL]
    pardoned = [verdict for verdict in meant if verdict.status is not Status.PASS]
    surprising = [verdict for verdict in meant if verdict.status is Status.PASS] if expected.criteria else []
    limit = f"a failure: {expected.reason}"
    name = EXPECTED if all(verdict.id != EXPECTED for verdict in verdicts) else f"{EXPECTED}#2"
    if surprising or not failed:
        told = f"{_listed(surprising)} held" if surprising else _nothing_failed(meant)
        return Outcome.FAILED, Verdict(EXPECTED, name, "fail", (missed(EXPECTED, told, limit),))
    others = [verdict for verdict in decisive if verdict.status is not Status.PASS and verdict not in pardoned]
    verdict = Verdict(EXPECTED, name, "fail", (held(EXPECTED, f"{_listed(failed)} failed", limit),))
    return (Outcome.FAILED if others else Outcome.FAILED_AS_EXPECTED), verdict


def _is_meant(verdict: Verdict, expected: ExpectedFailure) -> bool:
    return verdict.id in expected.criteria if expected.criteria else verdict.criterion != DISTURBANCE


def _nothing_failed(meant: Sequence[Verdict]) -> str:
    unclear = [verdict for verdict in meant if verdict.status is not Status.PASS]
    return f"nothing failed, {_listed(unclear)} undecided" if unclear else "everything held"


def _listed(verdicts: Sequence[Verdict]) -> str:
    return ", ".join(verdict.id for verdict in verdicts)
