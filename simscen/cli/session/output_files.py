"""Output files of a session: results.json, junit.xml, report.html, and run.json."""

import json
import os
import platform
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timezone
from functools import cached_property
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.cli.session.user_files import require_writable
from simscen.core.errors import UsageError
from simscen.core.records.comparison import Comparison
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished, SessionFinished
from simscen.core.records.study import Study
from simscen.report.journal_reader import JOURNAL_FILE
from simscen.report.junit import Family, xml_parts
from simscen.report.results_json import json_parts
from simscen.report.session_history import PastSession, past_sessions
from simscen.report.suite import RunningSession, SessionReport, to_html
from simscen.run.platform_fingerprint import arithmetic_fingerprints, cpu_flags, software_versions
from simscen.run.sessions.output_folder import RUNS_FOLDER, write_atomically

PAGE = "report.html"
"""Name of the HTML report in the output folder."""
RESERVED_NAMES = ("results.json", PAGE, "run.json", JOURNAL_FILE, RUNS_FOLDER)
"""Names in the output folder that `--junit` must not use."""


class Reports:
    """Writes the reports of a session to its output folder.

    folder:        output folder
    page:          path of the HTML report in the output folder
    junit:         further file for the JUnit report; None for no further file
    family:        dialect of JUnit XML
    junit_only:    whether to write only the file `junit`
    extra_entries: further entries of run.json: plug-ins and external stacks that the runs use
    is_resumable:  whether the command has the option --resume
    """

    def __init__(
        self,
        folder: Path,
        junit: Path | None,
        family: Family,
        junit_only: bool = False,
        extra_entries: Mapping[str, object] | None = None,
        is_resumable: bool = True,
    ) -> None:
        self.folder, self.page = folder, folder / PAGE
        self._junit, self._junit_only = junit or folder / "junit.xml", junit_only
        self._family: Family = family
        self._extra_entries, self._is_resumable = extra_entries or {}, is_resumable
        self._missing_reports = frozenset({self.page, self._junit})

    def begin(self) -> None:
        """Write run.json before the first run. Raises UsageError if the folder is not writable."""
        try:
            write_atomically(self.folder / "run.json", _session_info_json(self._extra_entries))
        except OSError as error:
            raise UsageError(f"cannot use the output folder {self.folder}: {error.strerror}") from error

    def write(
        self, finished_runs: Sequence[RunFinished], comparison: Comparison | None = None, study: Study | None = None
    ) -> bool:
        """Write the reports, and return whether all were written. A report that cannot be written is left unchanged."""
        folder, documents = str(self.folder), dict[Path, bytes | Iterable[bytes]]()
        if not self._junit_only:
            names = ("results.json", "junit.xml", "run.json")
            page = SessionReport(finished_runs, self._past_sessions, comparison, folder, names, study=study)
            results = json_parts(finished_runs, folder, comparison, study)
            documents[self.folder / "results.json"] = map(str.encode, results)
            documents[self.page] = to_html(page).encode()
            documents[self.folder / "junit.xml"] = xml_parts(finished_runs, self._family, study=study)
        documents[self._junit] = xml_parts(finished_runs, self._family, study=study)
        self._missing_reports = frozenset(path for path, data in documents.items() if not _write(path, data))
        return not self._missing_reports

    def write_live(self, finished_runs: Sequence[RunFinished], progress: RunningSession) -> bool:
        """Write the HTML report of a running session, and return whether it was written."""
        page = to_html(SessionReport(finished_runs, self._past_sessions, folder=str(self.folder), progress=progress))
        return _write(self.page, page.encode())

    @cached_property
    def _past_sessions(self) -> Sequence[PastSession]:
        return past_sessions(self.folder)

    def add_entries(self, entries: Mapping[str, object]) -> None:
        """Add entries to run.json. `write_duration` writes the file."""
        self._extra_entries = {**self._extra_entries, **entries}

    def write_duration(self, wall: float) -> bool:
        """Write run.json again with the duration of the session in seconds, and return whether it was written."""
        return _write(self.folder / "run.json", _session_info_json(self._extra_entries, wall))

    def finished_event(
        self,
        finished_runs: Sequence[RunFinished],
        wall: float,
        is_interrupted: bool,
        comparison: Comparison | None = None,
        study: Study | None = None,
    ) -> SessionFinished:
        """Return the last event of a session. `wall` is the wall-clock duration of the session in s.

        The path of a report is empty if the report was not written.
        """
        count, simulated = Counter[Outcome](), 0.0
        for finished in finished_runs:  # once, because a RunStore decompresses each run
            count[finished.outcome] += 1
            simulated += finished.result.simulated
        return SessionFinished(
            count[Outcome.PASSED],
            count[Outcome.FAILED],
            count[Outcome.ERROR],
            simulated=simulated,
            wall=wall,
            interrupted=is_interrupted,
            junit="" if self._junit in self._missing_reports else str(self._junit),
            folder=str(self.folder),
            comparison=comparison,
            expected=count[Outcome.FAILED_AS_EXPECTED],
            skipped=count[Outcome.SKIPPED],
            page="" if self._junit_only or self.page in self._missing_reports else str(self.page),
            study=study,
            is_resumable=self._is_resumable,
        )


def require_writable_junit(junit: Path | None, folder: Path | None, inputs: Iterable[Path] = ()) -> None:
    """Raise UsageError if the file `junit` of --junit cannot be written. Do nothing if `junit` is None.

    The file must not be one of the `inputs`, and must not have one of RESERVED_NAMES in the output `folder`, or in the
    output folder of another session.
    """
    if junit is None:
        return
    real, output = Path(os.path.realpath(junit)), None if folder is None else Path(os.path.realpath(folder))
    for parent in real.parents:
        is_output = parent == output or (parent / JOURNAL_FILE).exists()
        if is_output and real.relative_to(parent).parts[0] in RESERVED_NAMES:
            raise UsageError(f"cannot write {junit}: simscen writes another file with this name there")
    if output in real.parents and not real.exists():
        return  # its folder is created later, because a new output folder must be empty
    require_writable(junit, inputs)


def _write(path: Path, data: bytes | Iterable[bytes]) -> bool:
    try:
        write_atomically(path, data)
    except OSError as error:
        print_text(f"simscen: cannot write {path}: {error.strerror}", sys.stderr)
        return False
    return True


def _session_info_json(extra_entries: Mapping[str, object], wall: float | None = None) -> bytes:
    """Return the content of run.json with `extra_entries`.

    `wall` is the wall-clock duration of the session in s; None while the session runs.
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
            **extra_entries,
        },
        indent=2,
    ).encode()
