"""HTML report of a running session, which the option --open shows in a browser."""

import sys
import time
import webbrowser

from simscen.cli.diagnostics import print_text
from simscen.cli.session.output_files import Reports
from simscen.core.records.run_result import RunKey
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import RunFinished, RunStarted, SessionEvent, SessionStarted
from simscen.report.suite import RunningSession

MIN_UPDATE_INTERVAL_S = 1.0
"""Minimum time between two updates of the page."""
UPDATE_INTERVAL_FACTOR = 10
"""Minimum time between two updates of the page, as a multiple of the duration of an update."""


class LivePage:
    """Listener that opens the HTML report of a running session in a browser, and updates it."""

    def __init__(self, reports: Reports) -> None:
        self._reports = reports
        self._total, self._due = 0, 0.0
        self._finished_runs = RunStore()
        self._running: dict[RunKey, None] = {}

    def __call__(self, event: SessionEvent) -> None:
        """Write and open the page at the start of the session, and update it after runs."""
        match event:
            case SessionStarted():
                self._total = event.total
                self._write()
                self._open()
            case RunStarted():
                self._running[event.key] = None
            case RunFinished():
                self._running.pop(event.key, None)
                self._finished_runs.append(event)
                if time.monotonic() >= self._due:
                    self._write()
            case _:
                pass

    def _write(self) -> None:
        start = time.monotonic()
        self._reports.write_live(self._finished_runs, RunningSession(self._total, tuple(self._running)))
        now = time.monotonic()
        self._due = now + max(MIN_UPDATE_INTERVAL_S, UPDATE_INTERVAL_FACTOR * (now - start))

    def _open(self) -> None:
        """Open the page in the browser of $BROWSER or of the system. Without a browser, print its path."""
        if not webbrowser.open(self._reports.page.absolute().as_uri()):
            print_text(f"simscen: no browser found; open {self._reports.page} in a browser", sys.stderr)
