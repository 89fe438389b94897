"""What a session leaves behind: results.json, junit.xml, report.html, run.json; and its exit code."""

import errno
import json
import os
import platform
import sys
import time
import webbrowser
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime, timezone
from enum import Enum
from functools import cached_property
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.core.errors import Exit, UsageError
from simscen.core.files import require_not_input, require_regular_file
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import (
    Comparison,
    RunFinished,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.journal_reader import JOURNAL_FILE
from simscen.report.junit import Family, to_xml
from simscen.report.results_json import to_json
from simscen.report.suite import RunningSession, Session, to_html
from simscen.report.suite.history import PastSession, past_sessions
from simscen.run.reproducibility.environment import arithmetic_fingerprints, cpu_flags, software_versions
from simscen.run.sessions.output_folder import RUNS_FOLDER, probe_writable, write_atomically

PAGE = "report.html"
OWN = ("results.json", PAGE, "run.json", JOURNAL_FILE, RUNS_FOLDER)
"""What a session writes into its folder beside junit.xml."""


class JunitFamily(str, Enum):
    """Dialects of JUnit XML."""

    SIMSCEN = "simscen"
    XUNIT2 = "xunit2"


class Reports:
    """The reports of one session in `folder`; `junit` is the report that is named at the end.

    With `only`, that one is all that is written. `used` are the installed packages and external stacks of its runs.
    """

    def __init__(
        self,
        folder: Path,
        junit: Path | None,
        family: Family,
        only: bool = False,
        used: Mapping[str, object] | None = None,
    ) -> None:
        self.folder, self.junit, self._only = folder, junit or folder / "junit.xml", only
        self._used = used or {}
        self._missing: frozenset[Path] = frozenset()
        self._family: Family = family

    def begin(self) -> None:
        """Write run.json, so that a session that is killed has said where it ran. Raises UsageError."""
        try:
            write_atomically(self.folder / "run.json", session_info_json(self._used))
        except OSError as error:
            raise UsageError(f"cannot use the output folder {self.folder}: {error.strerror}") from error

    def write(self, answers: Sequence[RunFinished], comparison: Comparison | None = None) -> bool:
        """Write the reports; one that cannot be written is told, and the one before it stays whole."""
        junit = to_xml(answers, self._family)
        whole = {
            self.folder / "results.json": to_json(answers, str(self.folder), comparison).encode(),
            self.folder / "junit.xml": junit,
            self.folder / PAGE: self._page(answers, comparison),
        }
        documents = {**({} if self._only else whole), self.junit: junit}
        self._missing = frozenset(path for path, data in documents.items() if not _written(path, data))
        return not self._missing

    def write_live(self, answers: Sequence[RunFinished], live: RunningSession) -> bool:
        """Write the page of a session that goes on."""
        page = to_html(Session(answers, self._past, folder=str(self.folder), live=live))
        return _written(self.folder / PAGE, page.encode())

    def _page(self, answers: Sequence[RunFinished], comparison: Comparison | None) -> bytes:
        files = ("results.json", "junit.xml", "run.json")
        return to_html(Session(answers, self._past, comparison, str(self.folder), files)).encode()

    @cached_property
    def _past(self) -> Sequence[PastSession]:
        return past_sessions(self.folder)

    def end(self, wall: float) -> bool:
        """Write run.json anew, with the seconds that the session took."""
        return _written(self.folder / "run.json", session_info_json(self._used, wall))

    def closing(
        self, answers: Sequence[RunFinished], wall: float, interrupted: bool, comparison: Comparison | None = None
    ) -> SessionFinished:
        """The last event of a session; names no report that could not be written."""
        count = {outcome: sum(answer.outcome is outcome for answer in answers) for outcome in Outcome}
        return SessionFinished(
            count[Outcome.PASSED],
            count[Outcome.FAILED],
            count[Outcome.ERROR],
            simulated=sum(answer.result.simulated for answer in answers),
            wall=wall,
            interrupted=interrupted,
            junit="" if self.junit in self._missing else str(self.junit),
            folder=str(self.folder),
            comparison=comparison,
            expected=count[Outcome.FAILED_AS_EXPECTED],
            skipped=count[Outcome.SKIPPED],
            page="" if self._only or self.folder / PAGE in self._missing else str(self.folder / PAGE),
        )


def verdict(answers: Sequence[RunFinished]) -> Exit:
    """The exit code of a session that was not interrupted."""
    outcomes = {answer.outcome for answer in answers}
    if outcomes == {Outcome.SKIPPED}:
        return Exit.NOTHING_SELECTED
    if Outcome.ERROR in outcomes:
        only_skipped = all(a.result.error is None or a.result.error.kind == "not-run" for a in answers)
        return Exit.FAILED if only_skipped and Outcome.FAILED in outcomes else Exit.INCOMPLETE
    return Exit.FAILED if Outcome.FAILED in outcomes else Exit.PASSED


def require_writable(junit: Path | None, folder: Path | None, inputs: Iterable[Path] = ()) -> None:
    """Raise UsageError for a report that cannot be written: that should be known before anything runs.

    Nor may it be one of the `inputs`, or what else simscen writes in its output `folder`.
    """
    if junit is None:
        return
    try:
        _require_free_name(junit, folder)
        require_not_input(junit, inputs)
        junit.parent.mkdir(parents=True, exist_ok=True)
        probe_writable(junit)
    except OSError as error:
        raise UsageError(f"cannot write {junit}: {error.strerror}") from error


def _require_free_name(junit: Path, folder: Path | None) -> None:
    """Raise OSError where simscen writes something else of that name, in this session's folder or another's."""
    real = Path(os.path.realpath(junit))
    for home in real.parents:
        is_output = home == (folder and Path(os.path.realpath(folder))) or (home / JOURNAL_FILE).exists()
        if is_output and real.relative_to(home).parts[0] in OWN:
            raise OSError(errno.EINVAL, "the output folder has something else of that name")


def _written(path: Path, data: bytes) -> bool:
    try:
        write_atomically(path, data)
    except OSError as error:
        print_text(f"simscen: cannot write {path}: {error.strerror}", sys.stderr)
        return False
    return True


def session_info_json(used: Mapping[str, object], wall: float | None = None) -> bytes:
    """run.json; `used` are installed packages and external stacks, `wall` the seconds that the session took.

    While it is under way `wall` is None.
    """
    return json.dumps(
        {
            "written": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "wall_seconds": None if wall is None else round(wall, 3),
            "host": platform.node(),
            "command": sys.argv,
            "machine": platform.machine(),
            "cores": os.cpu_count(),
            "cpu_flags": cpu_flags(),
            "arithmetic": arithmetic_fingerprints(),
            "packages": software_versions(),
            **used,
        },
        indent=2,
    ).encode()


def save(path: Path, write: Callable[[Path], None], inputs: Iterable[Path] = ()) -> None:
    """Let `write` make the file; raises UsageError where that cannot be done or would overwrite what was read."""
    try:
        require_regular_file(path)
        require_not_input(path, inputs)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path)
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error


# MERGED: `simscen run --open`: the session's page in a browser while it runs, written anew as runs end; no server.
MIN_UPDATE_INTERVAL_S = 1.0
"""Seconds from one writing of the page to the next; the page itself looks every two seconds."""
UPDATE_INTERVAL_FACTOR = 10
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
        self._due = now + max(MIN_UPDATE_INTERVAL_S, UPDATE_INTERVAL_FACTOR * (now - begun))


def open_page(page: Path) -> None:
    """Show a page in the reader's browser ($BROWSER, or the system's); say where it is when there is none."""
    if not webbrowser.open(page.absolute().as_uri()):
        print_text(f"simscen: no browser was found; open {page} in one", sys.stderr)
