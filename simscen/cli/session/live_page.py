"""`simscen run --open`: the session's page in a browser while it runs, written anew as runs end; no server."""

import sys
import time
import webbrowser
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.cli.session.output_files import PAGE, Reports
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished, RunStarted, SessionEvent, SessionStarted
from simscen.report.suite import RunningSession

LEAST_PAUSE = 1.0
"""Seconds from one writing of the page to the next; the page itself looks every two seconds."""
SHARE = 10
"""Of the time that passes, writing takes no more than a tenth."""


class LivePage:
    """Listens to a session; its page is there, and open, before anything runs. The last one is that of the reports."""

    def __init__(self, reports: Reports) -> None:
        self._reports = reports
        self._total, self._due = 0, 0.0
        self._answers: list[RunFinished] = []
        self._under_way: dict[RunKey, None] = {}

    def __call__(self, event: SessionEvent) -> None:
        """Write the page anew where something ended, and it is time."""
        match event:
            case SessionStarted():
                self._total = event.total
                self._write()
                open_page(self._reports.folder / PAGE)
            case RunStarted():
                self._under_way[event.key] = None
            case RunFinished():
                self._under_way.pop(event.key, None)
                self._answers.append(event)
                if time.monotonic() >= self._due:
                    self._write()
            case _:
                pass

    def _write(self) -> None:
        begun = time.monotonic()
        self._reports.write_live(self._answers, RunningSession(self._total, tuple(self._under_way)))
        now = time.monotonic()
        self._due = now + max(LEAST_PAUSE, SHARE * (now - begun))


def open_page(page: Path) -> None:
    """Show a page in the reader's browser ($BROWSER, or the system's); say where it is when there is none."""
    if not webbrowser.open(page.absolute().as_uri()):
        print_text(f"simscen: no browser was found; open {page} in one", sys.stderr)
