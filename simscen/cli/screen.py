"""What a session prints. Its files matter more: a full disk or a closed pipe behind stdout ends the printing only."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TextIO

from simscen.cli.diagnostics import print_text
from simscen.core.errors import Exit
from simscen.core.sessionevents import SessionEvent
from simscen.report.console import Reporter, text_reporter
from simscen.report.github import github_reporter
from simscen.report.machine import json_reporter


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


class Screen:
    """Passes events on until the printer fails; `lost` is why."""

    def __init__(self, printer: Reporter) -> None:
        self._printer = printer
        self.lost: OSError | None = None

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

    def exit(self, code: Exit) -> Exit:
        """The exit code of the session, or that of output that was lost. Who closes a pipe has read enough."""
        if self.lost is None or isinstance(self.lost, BrokenPipeError):
            return code
        print_text(f"simscen: cannot write to stdout: {self.lost.strerror}", sys.stderr)
        return max(code, Exit.INCOMPLETE)


@contextmanager
def screen(format_: Format) -> Iterator[Screen]:
    """Print a session on stdout, and on GitHub also as the summary of the step."""
    with _step_summary() as summary:
        printer = _printer(format_, summary)
        shown = Screen(printer)
        printer.__enter__()
        try:
            yield shown
        finally:
            with shown.forgiving():
                printer.__exit__(*sys.exc_info())


def _printer(format_: Format, summary: TextIO | None) -> Reporter:
    match format_:
        case Format.TEXT:
            return text_reporter(sys.stdout)
        case Format.JSON:
            return json_reporter(sys.stdout)
        case Format.GITHUB:
            return github_reporter(sys.stdout, summary)


@contextmanager
def _step_summary() -> Iterator[TextIO | None]:
    """The file that GitHub Actions shows as the summary of a step, where there is one."""
    path = os.environ.get("GITHUB_STEP_SUMMARY")
    if not path:
        yield None
        return
    with Path(path).open("a", encoding="utf-8") as file:
        yield file
