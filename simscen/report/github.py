"""Reporter for GitHub Actions: annotations at the lines of violated criteria, and a job summary in Markdown."""

from collections.abc import Sequence
from heapq import nsmallest
from itertools import accumulate
from typing import TextIO
from urllib.parse import quote

from simscen.core.records.run_result import Outcome
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import RunFinished, SessionEvent, SessionFinished
from simscen.judge.finding_text import tightest_margin
from simscen.report.comparison_markup import comparison_markdown, markdown_cell
from simscen.report.console_reporter import text_reporter
from simscen.report.display_text import relative_path, relative_to_checkout
from simscen.report.reporters import Reporter
from simscen.report.violations import (
    error_summary,
    failed_violations,
    reason_without_failure,
    reported_violations,
    scenario_file,
    short_run_name,
)

MAX_PICTURES = 10
"""Maximum number of pictures in the summary."""
MAX_ROWS, MAX_TABLE_BYTES = 1000, 2**19
"""Maximum number of runs in the summary, and maximum size of all rows together.

GitHub refuses a summary of more than 1 MiB."""


class GitHubReporter(Reporter):
    """Prints console lines and annotations to `out`, and at the end of the session the job summary to `summary`.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list). `pictures_url` is the URL of
    the uploaded output folder; without it, the summary has no pictures.
    """

    def __init__(
        self, out: TextIO, summary: TextIO | None = None, slow: int | None = None, pictures_url: str = ""
    ) -> None:
        self._out, self._summary, self._pictures_url = out, summary, pictures_url
        self._console = text_reporter(out, live=False, slow=slow)
        self._runs = RunStore()

    def __call__(self, event: SessionEvent) -> None:
        """Print the event, with annotations for a finished run, and write the summary at the end."""
        self._console(event)
        if isinstance(event, RunFinished):
            self._runs.append(event)
            for line in annotations(event):
                self._out.write(f"{line}\n")
            self._out.flush()
        if isinstance(event, SessionFinished) and self._summary is not None:
            self._summary.write(summary_markdown(self._runs, event, self._pictures_url))
            self._summary.flush()


def annotations(run: RunFinished) -> list[str]:
    """Return workflow commands, such as `::error file=…::…`, that annotate the scenario file of a run.

    A run has one annotation per violation, and one for its error. A skipped run or an expected failure has one notice.
    """
    name = short_run_name(run.key)
    if reason := reason_without_failure(run):
        line = next((violation.line for violation in failed_violations(run)), 0)
        return [_workflow_command("notice", run, line, name, reason)]
    lines = [
        _workflow_command(
            "warning" if violation.is_warning else "error",
            run,
            violation.line,
            name,
            "\n".join((violation.message, *violation.detail)),
        )
        for violation in reported_violations(run)
    ]
    if run.outcome is Outcome.ERROR:
        lines.append(_workflow_command("error", run, 0, name, error_summary(run)))
    return lines


def summary_markdown(runs: Sequence[RunFinished], session: SessionFinished, pictures_url: str = "") -> str:
    """Return the job summary: counts, a table of runs, and the comparison of several stacks.

    The table begins with errors and failures. With `pictures_url`, the URL of the output folder, the summary also
    contains pictures of these runs.
    """
    symbols = {
        Outcome.ERROR: "⚠️",
        Outcome.FAILED: "❌",
        Outcome.FAILED_AS_EXPECTED: "🟡",
        Outcome.SKIPPED: "⏭️",
        Outcome.PASSED: "✅",
    }
    order = list(symbols)
    listed = nsmallest(MAX_ROWS, runs, key=lambda run: (order.index(run.outcome), run.result.path, run.key))
    errors = "error" if session.errors == 1 else "errors"
    more = f", {session.expected} failed as expected" if session.expected else ""
    more += f", {session.skipped} skipped" if session.skipped else ""
    head = f"### simscen: {session.passed} passed, {session.failed} failed, {session.errors} {errors}{more}"
    comparison = [] if session.comparison is None else comparison_markdown(session.comparison)
    rows = [
        f"| {symbols[run.outcome]} | {markdown_cell(short_run_name(run.key))} "
        f"| {run.result.simulated:.1f} s | {_reason_cell(run)} |"
        for run in listed
    ]
    sizes = accumulate(len(row.encode()) for row in rows)
    rows = [row for row, size in zip(rows, sizes, strict=True) if size <= MAX_TABLE_BYTES]
    if len(rows) < len(runs):
        rows.append(f"| | and {len(runs) - len(rows)} more | | |")
    picture_lines = _picture_lines(listed, session.folder, pictures_url) if pictures_url else []
    table = ["| | scenario | simulated | |", "|---|---|---:|---|", *rows]
    return "\n".join([head, "", *table, *comparison, "", *picture_lines, ""])


def _picture_lines(runs: list[RunFinished], folder: str, pictures_url: str) -> list[str]:
    """Return the pictures of the first runs that did not pass. `folder` is the output folder of the session."""
    failures = [run for run in runs if not run.outcome.is_good and run.artifacts.picture]
    lines = []
    for run in failures[:MAX_PICTURES]:
        address = f"{pictures_url.rstrip('/')}/{quote(relative_path(run.artifacts.picture, folder))}"
        lines += [f"**{markdown_cell(short_run_name(run.key))}**", "", f"![map of the run]({address})", ""]
    return lines


def _reason_cell(run: RunFinished) -> str:
    """Return a table cell: the error, violated criteria, why a failure does not count, or the tightest margin."""
    if run.outcome is Outcome.ERROR:
        return markdown_cell(error_summary(run))
    if reason := reason_without_failure(run):
        return markdown_cell(reason)
    messages = [markdown_cell(violation.message) for violation in reported_violations(run)]
    tightest = tightest_margin(run.result.verdicts)
    return "<br>".join(messages) if messages or not tightest else f"tightest: {markdown_cell(tightest)}"


def _workflow_command(level: str, run: RunFinished, line: int, title: str, message: str) -> str:
    """Return a workflow command. `level` is error, warning, or notice. `line` 0 (unknown) becomes line 1."""
    file = relative_to_checkout(scenario_file(run))
    properties = f"file={_escape_property(file)},line={max(line or 1, 1)},title={_escape_property(title)}"
    return f"::{level} {properties}::{_escape_message(message)}"


def _escape_message(text: str) -> str:
    """Escape the message of a workflow command as GitHub's package @actions/core does."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_message(text).replace(":", "%3A").replace(",", "%2C")
