"""Exit code of a session by the outcomes of its runs, or by the claim of its study."""

from collections.abc import Sequence

from simscen.core.errors import Exit
from simscen.core.records.run_result import NOT_RUN, Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import ClaimStatus, Study

CLAIM_EXIT_CODES = {
    ClaimStatus.HELD: Exit.PASSED,
    ClaimStatus.REFUTED: Exit.FAILED,
    ClaimStatus.UNDECIDED: Exit.UNDECIDED,
    ClaimStatus.BLOCKED: Exit.INCOMPLETE,
}
"""Exit code of a study by the status of its claim, the pass rate that the study tests."""


def exit_code(finished_runs: Sequence[RunFinished], study: Study | None = None) -> Exit:
    """Return the exit code of a session that was not interrupted.

    If a study has a claim, the exit code depends on its status, otherwise on the outcomes of the runs.
    """
    if study is not None and study.claim is not None:
        return CLAIM_EXIT_CODES[study.claim.status]
    outcomes = {finished.outcome for finished in finished_runs}
    if outcomes <= {Outcome.SKIPPED}:
        return Exit.NOTHING_SELECTED
    if Outcome.ERROR in outcomes:
        only_not_run = all(a.result.error is None or a.result.error.kind == NOT_RUN for a in finished_runs)
        return Exit.FAILED if only_not_run and Outcome.FAILED in outcomes else Exit.INCOMPLETE
    return Exit.FAILED if Outcome.FAILED in outcomes else Exit.PASSED
