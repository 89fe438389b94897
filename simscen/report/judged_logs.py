"""Console lines of `simscen judge`: full result of one log, one line per log, or a table of margins of all logs.

A margin is the distance between a value and its limit. It is negative if the limit is violated.
"""

from collections import Counter
from collections.abc import Iterator, Sequence

from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Status, Verdict
from simscen.judge.finding_text import tightest_margin
from simscen.report.display_text import StyledLine, StyledText, one_line
from simscen.report.session_lines import SYMBOLS, violation_lines
from simscen.report.violations import error_summary, first_violation, reason_without_failure


def full_log_lines(run: RunFinished, name: str) -> Iterator[StyledLine]:
    """Yield a line with the outcome of a log, its length in s, and a note, then the lines of `violation_lines`."""
    tightest = tightest_margin(run.result.verdicts) if run.outcome is Outcome.PASSED else ""
    note = f"tightest: {one_line(tightest)}" if tightest else reason_without_failure(run)
    yield (*_outcome_and_length(run.result, name), *((StyledText(f"   {note}", "quiet"),) if note else ()))
    yield from violation_lines(run)


def short_log_line(run: RunFinished, name: str) -> StyledLine:
    """Return a line with the outcome of a log, its length in s, and its error, first violation, or tightest margin."""
    if run.outcome is Outcome.ERROR:
        return (*_outcome_and_length(run.result, name), StyledText(f"   {error_summary(run)}", "warning"))
    if reason := reason_without_failure(run):
        return (*_outcome_and_length(run.result, name), StyledText(f"   {reason}", "quiet"))
    tightest = one_line(tightest_margin(run.result.verdicts))
    note = first_violation(run) or (f"tightest: {tightest}" if tightest else "")
    return (*_outcome_and_length(run.result, name), StyledText(f"   {note}".rstrip(), "quiet"))


def margin_table(runs: Sequence[tuple[str, RunFinished]]) -> Iterator[StyledLine]:
    """Yield a table of margins with a row per log and a column per criterion, then the reasons for missing margins.

    `runs` are pairs of the name of a log and its result.
    """
    ids = list(dict.fromkeys(verdict.id for _, run in runs for verdict in run.result.verdicts))
    rows = [[one_line(name), *(_margin_cell(run.result, verdict_id) for verdict_id in ids)] for name, run in runs]
    columns = list(zip(["log", *ids], *rows, strict=True))
    widths = [max(len(text) for text in column) for column in columns]

    def align(row: Sequence[str]) -> str:
        first, *others = (text.ljust(width) for text, width in zip(row, widths, strict=True))
        return "   ".join((first, *others))

    yield (StyledText(f"    {align(['log', *ids])}", "quiet"),)
    for row, (_, run) in zip(rows, runs, strict=True):
        symbol, role = SYMBOLS[run.outcome]
        yield (StyledText("  "), StyledText(symbol, role), StyledText(f" {align(row)}"))
    yield from (((StyledText(f"  {text}", "quiet"),)) for text in _reasons(runs))


def summary_line(runs: Sequence[RunFinished]) -> StyledLine:
    """Return the numbers of outcomes, for example "12 passed, 1 failed"."""
    count = Counter(run.outcome for run in runs)
    labels = [(Outcome.PASSED, "passed"), (Outcome.FAILED, "failed"), (Outcome.ERROR, "could not be judged")]
    labels += [(Outcome.FAILED_AS_EXPECTED, "failed as expected"), (Outcome.SKIPPED, "skipped")]
    parts = [f"{count[outcome]} {word}" for outcome, word in labels if count[outcome] or outcome is Outcome.PASSED]
    return (StyledText(", ".join(parts)),)


def _outcome_and_length(result: RunResult, name: str) -> tuple[StyledText, ...]:
    symbol, role = SYMBOLS[result.outcome]
    length = f"   {result.simulated:.1f} s recorded" if result.simulated else ""
    return (
        StyledText("  "),
        StyledText(symbol, role),
        StyledText(f" {one_line(name)}", "name"),
        StyledText(length, "quiet"),
    )


def _margin_cell(result: RunResult, verdict_id: str) -> str:
    """Return the margin of a verdict as text. Without a margin, return "holds", "fails", "?", "error", or "-".

    "?" is an inconclusive verdict, "-" a missing one.
    """
    verdict = next((verdict for verdict in result.verdicts if verdict.id == verdict_id), None)
    if verdict is None:
        return "-"
    if verdict.status in (Status.INCONCLUSIVE, Status.ERROR):
        return "?" if verdict.status is Status.INCONCLUSIVE else "error"
    finding = verdict.tightest
    word = "holds" if verdict.status is Status.PASS else "fails"
    margin = None if finding is None else finding.margin
    text = word if finding is None or margin is None else _margin_text(margin, finding.unit)
    return f"{text} (warning)" if verdict.severity == "warn" and verdict.status is Status.FAIL else text


def _margin_text(margin: float, unit: str) -> str:
    """Format a margin with its sign. Counts become integers. A small margin is never rounded to zero."""
    if not unit and margin == round(margin):
        return f"{margin:+.0f}"
    return f"{margin:+.2f} {unit}".rstrip() if margin == 0 or abs(margin) >= 0.005 else f"{margin:+.1g} {unit}".rstrip()


def _reasons(runs: Sequence[tuple[str, RunFinished]]) -> Iterator[str]:
    """Yield the distinct reasons of undecided criteria, and then the error of each log that could not be judged."""
    reasons = Counter(
        reason for _, run in runs for verdict in run.result.verdicts for reason in _undecided_reason(verdict)
    )
    for reason, number in reasons.items():
        yield f"{reason} ({number} logs)" if number > 1 else reason
    for name, run in runs:
        if run.outcome is Outcome.ERROR:
            yield one_line(f"{name}: {error_summary(run)}")


def _undecided_reason(verdict: Verdict) -> Iterator[str]:
    """Yield the reason of a verdict that is inconclusive or an error. Yield nothing for other verdicts."""
    if verdict.status in (Status.INCONCLUSIVE, Status.ERROR) and verdict.tightest is not None:
        symbol = "?" if verdict.status is Status.INCONCLUSIVE else "error:"
        reasons = "; ".join(verdict.tightest.detail)
        yield one_line(f"{symbol} {verdict.id}: {verdict.tightest.measured}" + (f" ({reasons})" if reasons else ""))
