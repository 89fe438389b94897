"""Output of a session on stdout. An error of stdout, such as a closed pipe, does not end the session."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.cli.process import discard_output
from simscen.cli.shared_options import Format
from simscen.core.errors import Exit, UsageError
from simscen.core.files import probe_writable
from simscen.core.records.session_events import SessionEvent
from simscen.report.console_reporter import text_reporter
from simscen.report.github import GitHubReporter
from simscen.report.reporters import JsonReporter, Reporter

STEP_SUMMARY = "GITHUB_STEP_SUMMARY"
"""Environment variable with the path of the file for the job summary of GitHub Actions."""
PICTURES_URL = "SIMSCEN_PICTURES_URL"
"""Environment variable with the URL of the uploaded output folder, for the pictures in the job summary."""


class Screen:
    """Prints the events of a session until stdout fails.

    `stdout_error` is the first error of writing to stdout, and `summary_error` the error of writing the job summary;
    None without an error.
    """

    def __init__(self, printer: Reporter) -> None:
        self._printer = printer
        self.stdout_error: OSError | None = None
        self.summary_error: OSError | None = None

    def __call__(self, event: SessionEvent) -> None:
        """Print an event."""
        if self.stdout_error is None:
            with self.suppress_errors():
                self._printer(event)

    @contextmanager
    def suppress_errors(self) -> Iterator[None]:
        """Within the context, record an error of stdout, and discard all further output."""
        try:
            yield
        except OSError as error:
            self.stdout_error = self.stdout_error or error
            discard_output(sys.stdout.fileno())

    def append_summary(self, text: str) -> None:
        """Append text to the job summary of GitHub Actions."""
        try:
            with Path(os.environ[STEP_SUMMARY]).open("a", encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            self.summary_error = error

    def exit_code(self, code: Exit) -> Exit:
        """Return `code`, the exit code of the session; if output was lost, print why, and return at least INCOMPLETE.

        A closed pipe does not count as lost output.
        """
        errors = {STEP_SUMMARY: self.summary_error}
        if not isinstance(self.stdout_error, BrokenPipeError):
            errors["to stdout"] = self.stdout_error
        for target, error in errors.items():
            if error is not None:
                print_text(f"simscen: cannot write {target}: {error.strerror}", sys.stderr)
                code = max(code, Exit.INCOMPLETE)
        return code


@contextmanager
def open_screen(format_: Format, slowest_count: int | None = None) -> Iterator[Screen]:
    """Provide a Screen within the context. Afterwards, restore the terminal and write the job summary.

    `slowest_count` is the number of slowest runs to list at the end: 0 lists all, None lists none. Only the format
    GITHUB has a job summary. Raises UsageError if the file of the summary is not writable.
    """
    summary = None
    if format_ is Format.GITHUB and (path := os.environ.get(STEP_SUMMARY)):
        try:
            probe_writable(Path(path))
        except OSError as error:
            raise UsageError(f"cannot write {STEP_SUMMARY} {path}: {error.strerror}") from error
        summary = StringIO()
    printer: Reporter
    match format_:
        case Format.TEXT:
            printer = text_reporter(sys.stdout, slow=slowest_count)
        case Format.JSON:
            printer = JsonReporter(sys.stdout)
        case Format.GITHUB:
            printer = GitHubReporter(sys.stdout, summary, slowest_count, os.environ.get(PICTURES_URL, ""))
    output = Screen(printer)
    printer.__enter__()
    try:
        yield output
    finally:
        with output.suppress_errors():
            printer.__exit__(*sys.exc_info())
        if summary is not None:
            output.append_summary(summary.getvalue())
