"""Outcome of a run from its verdicts, including runs that are expected to fail."""

from collections.abc import Collection, Sequence

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import ExpectedFailure, Status, Verdict, unique_name
from simscen.criteria.findings import held, missed
from simscen.judge.finding_text import DISTURBANCE


def outcome_of_verdicts(verdicts: Sequence[Verdict]) -> Outcome:
    """Return the outcome of a completed run.

    The run is an error if any verdict is an error or if there are no verdicts. Otherwise, the run passes if all
    verdicts of severity `fail` pass; an inconclusive verdict does not pass.
    """
    if not verdicts or any(verdict.status is Status.ERROR for verdict in verdicts):
        return Outcome.ERROR
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    return Outcome.PASSED if all(verdict.status is Status.PASS for verdict in decisive) else Outcome.FAILED


EXPECTED = "expected"
"""Criterion name of the verdict on an expected failure."""


def apply_expectation(
    expected: ExpectedFailure | None,
    verdicts: Sequence[Verdict],
    outcome: Outcome,
    is_complete: bool,
    happened: Collection[str] = (),
) -> tuple[Outcome, Verdict | None]:
    """Return the outcome of a run that is `expected` to fail, and a verdict on this expectation.

    If no failure is expected, if `outcome` is an error, or if the log is not complete, return `outcome` and no verdict.

    As with pytest's `xfail(strict=True)`, the outcome is FAILED_AS_EXPECTED if a criterion fails, otherwise FAILED.

    `expected.criteria` can list criteria and disturbances. The outcome is then also FAILED in these cases:

    - A listed criterion passes, or a criterion that is not listed does not pass.
    - A listed disturbance happened, unless another disturbance of the same name did not. `happened` are the names of
      all disturbances that happened.

    Without this list, any criterion can fail. A required disturbance that is not listed must always happen.
    """
    if expected is None or outcome is Outcome.ERROR or not is_complete:
        return outcome, None
    decisive = [verdict for verdict in verdicts if verdict.severity == "fail"]
    covered = [verdict for verdict in decisive if _is_expected_to_fail(verdict, expected)]
    failed = [verdict for verdict in covered if verdict.status is Status.FAIL]
    excused = [verdict for verdict in covered if verdict.status is not Status.PASS]
    ids = {verdict.id for verdict in verdicts}
    # A disturbance that did not happen has a verdict.
    unexpected = [f"{name} happened" for name in expected.criteria if name in happened and name not in ids]
    if passed := [verdict for verdict in covered if verdict.status is Status.PASS and expected.criteria]:
        unexpected.insert(0, f"{_names(passed)} passed")
    limit = f"a failure: {expected.reason}"
    name = unique_name(EXPECTED, ids)
    if unexpected or not failed:
        no_failure = f"nothing failed, {_names(excused)} undecided" if excused else "everything passed"
        measured = ", ".join(unexpected) or no_failure
        return Outcome.FAILED, Verdict(EXPECTED, name, "fail", (missed(EXPECTED, measured, limit),))
    not_excused = [verdict for verdict in decisive if verdict.status is not Status.PASS and verdict not in excused]
    verdict = Verdict(EXPECTED, name, "fail", (held(EXPECTED, f"{_names(failed)} failed", limit),))
    return (Outcome.FAILED if not_excused else Outcome.FAILED_AS_EXPECTED), verdict


def _is_expected_to_fail(verdict: Verdict, expected: ExpectedFailure) -> bool:
    """Return whether the criterion is listed; without a list, whether the verdict is not about a disturbance."""
    return verdict.id in expected.criteria if expected.criteria else verdict.criterion != DISTURBANCE


def _names(verdicts: Sequence[Verdict]) -> str:
    return ", ".join(verdict.id for verdict in verdicts)
