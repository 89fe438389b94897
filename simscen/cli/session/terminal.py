"""What a session prints. Its files matter more: a full disk or a closed pipe behind stdout ends the printing only."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from io import StringIO
from pathlib import Path
from typing import TextIO

from simscen.cli.diagnostics import print_text
from simscen.core.errors import Exit, UsageError
from simscen.core.records.session_events import SessionEvent
from simscen.report.console import text_reporter
from simscen.report.github import github_reporter
from simscen.report.results_json import json_reporter
from simscen.report.text_reporters import Reporter
from simscen.run.sessions.output_folder import probe_writable

STEP_SUMMARY = "GITHUB_STEP_SUMMARY"
PICTURES_URL = "SIMSCEN_PICTURES_URL"
"""Names the address at which the pictures of the output folder will be found by who reads the summary."""


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


class Screen:
    """Passes events on until the printer fails; `lost` is why, `lost_summary` why there is no summary of the step."""

    def __init__(self, printer: Reporter) -> None:
        self._printer = printer
        self.lost: OSError | None = None
        self.lost_summary: OSError | None = None

    def __call__(self, event: SessionEvent) -> None:
        """Print what the event is worth."""
        if self.lost is None:
            with self.forgiving():
                self._printer(event)

    @contextmanager
    def forgiving(self) -> Iterator[None]:
        """Survive a stdout that takes no more, and keep the interpreter from failing on it when it flushes at exit."""
        try:
            yield
        except OSError as error:
            self.lost = self.lost or error
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, sys.stdout.fileno())
            os.close(nowhere)

    def sum_up(self, text: str) -> None:
        """Add to the file that GitHub Actions shows as the summary of a step."""
        try:
            with Path(os.environ[STEP_SUMMARY]).open("a", encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            self.lost_summary = error

    def exit(self, code: Exit) -> Exit:
        """The exit code of the session, or that of output that was lost. Who closes a pipe has read enough."""
        lost = {STEP_SUMMARY: self.lost_summary}
        if not isinstance(self.lost, BrokenPipeError):
            lost["to stdout"] = self.lost
        for what, error in lost.items():
            if error is not None:
                print_text(f"simscen: cannot write {what}: {error.strerror}", sys.stderr)
                code = max(code, Exit.INCOMPLETE)
        return code


@contextmanager
def screen(format_: Format, slow: int | None = None) -> Iterator[Screen]:
    """Print a session on stdout, and on GitHub also as the summary of the step.

    `slow` is how many of the slowest runs to list in the end; 0 = all.

    Raises UsageError when that cannot be written: it should be known before anything runs.
    """
    summary = _step_summary() if format_ is Format.GITHUB else None
    printer = _printer(format_, summary, slow)
    shown = Screen(printer)
    printer.__enter__()
    try:
        yield shown
    finally:
        with shown.forgiving():
            printer.__exit__(*sys.exc_info())
        if summary is not None:
            shown.sum_up(summary.getvalue())


def _printer(format_: Format, summary: TextIO | None, slow: int | None) -> Reporter:
    match format_:
        case Format.TEXT:
            return text_reporter(sys.stdout, slow=slow)
        case Format.JSON:
            return json_reporter(sys.stdout)
        case Format.GITHUB:
            return github_reporter(sys.stdout, summary, slow, os.environ.get(PICTURES_URL, ""))


def _step_summary() -> StringIO | None:
    """Where the summary of the step is put together, where there is one."""
    path = os.environ.get(STEP_SUMMARY)
    if not path:
        return None
    try:
        probe_writable(Path(path))
    except OSError as error:
        raise UsageError(f"cannot write {STEP_SUMMARY} {path}: {error.strerror}") from error
    return StringIO()
