"""Earlier sessions: outcomes of their runs for the HTML report, and failed runs for `simscen run --last-failed`."""

import json
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import read_key
from simscen.report.journal_reader import JOURNAL_FILE, read_journal

MAX_SHOWN_SESSIONS = 10
"""Maximum number of earlier sessions in the report."""
MAX_RESULTS_BYTES = 64 << 20
"""Maximum size of a results.json to read."""


@dataclass(frozen=True)
class PastOutcome:
    """Outcome of a run in an earlier session, with the simulated time in s."""

    outcome: Outcome
    simulated: float


@dataclass(frozen=True)
class PastSession:
    """An earlier session: the name of its folder, and the outcomes of its runs."""

    name: str
    runs: Mapping[RunKey, PastOutcome] = field(default_factory=dict)

    def count(self, *outcomes: Outcome) -> int:
        """Return the number of runs with one of these outcomes."""
        return sum(run.outcome in outcomes for run in self.runs.values())


def past_sessions(folder: Path) -> list[PastSession]:
    """Return the sessions in the parent folder of `folder` that are older than the session in `folder`, newest first.

    At most MAX_SHOWN_SESSIONS are returned. Sessions without a readable results.json are omitted. `folder` can be a
    link, such as `latest`.
    """
    folder = folder.resolve()
    folders = sessions_in(folder.parent)
    index = next((k for k, each in enumerate(folders) if each.name == folder.name), len(folders))
    sessions = (past for each in folders[index + 1 :] if (past := _read_session(each)) is not None)
    return list(islice(sessions, MAX_SHOWN_SESSIONS))


def _read_session(folder: Path) -> PastSession | None:
    """Read results.json of a session. Return None if the file is missing, too large, or invalid."""
    try:
        file = folder / "results.json"
        if file.stat().st_size > MAX_RESULTS_BYTES:
            return None
        document: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        runs = {
            read_key(run): PastOutcome(Outcome(run["outcome"]), float(run["simulated_seconds"]))
            for run in document["runs"]
        }
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return PastSession(folder.name, runs)


def past_outcomes(run: RunFinished, past: Sequence[PastSession]) -> list[PastOutcome | None]:
    """Return the outcomes of a run in the earlier sessions, oldest first, with None for a session without the run."""
    return [session.runs.get(run.key) for session in reversed(past)]


def outcome_change(run: RunFinished, past: Sequence[PastSession]) -> str:
    """Return a text such as "failed before" if the outcome of the run changed from good to bad or from bad to good.

    Return "" if the outcome has not changed, or if no earlier session contains the run.
    """
    previous = changed_outcome(run, past_outcomes(run, past))
    return "" if previous is None else f"{previous.value.replace('-', ' ')} before"


def changed_outcome(run: RunFinished, past: Sequence[PastOutcome | None]) -> Outcome | None:
    """Return the previous outcome if the run was good and is now bad, or was bad and is now good; otherwise None.

    `past` are the outcomes in earlier sessions, oldest first, with None for a session without the run. Sessions that
    skipped the run are ignored. A run that is now skipped has not changed.
    """
    outcomes = (earlier.outcome for earlier in reversed(past) if earlier is not None)
    previous = next((outcome for outcome in outcomes if outcome is not Outcome.SKIPPED), None)
    if previous is None or run.outcome is Outcome.SKIPPED:
        return None
    return previous if previous.is_good != run.outcome.is_good else None


MAX_SEARCHED_SESSIONS = 50
"""Maximum number of sessions to search for failures."""


def sessions_in(folder: Path) -> list[Path]:
    """Return the session output folders in `folder`, newest first, without symbolic links such as `latest`.

    Folders that cannot be read, for example those of other users, are omitted.
    """
    try:
        entries = list(folder.iterdir())
    except OSError:
        return []
    times = {each: time for each in entries if not each.is_symlink() and (time := _journal_time(each)) is not None}
    return sorted(times, key=lambda each: (_session_time(each), times[each], each.name), reverse=True)


def _journal_time(session: Path) -> int | None:
    """Return when the journal in a folder was last written, in ns; None without a readable journal."""
    try:
        status = (session / JOURNAL_FILE).stat()
    except OSError:
        return None
    return status.st_mtime_ns if stat.S_ISREG(status.st_mode) else None


def last_failed(folder: Path) -> frozenset[RunKey] | None:
    """Return the runs whose latest outcome is bad, from the sessions in `folder`; None if there are no sessions.

    Only the newest MAX_SEARCHED_SESSIONS are read. A run and its repetition count as one run.
    """
    sessions = sessions_in(folder)
    if not sessions:
        return None
    latest: dict[RunKey, bool] = {}
    for session in islice(sessions, MAX_SEARCHED_SESSIONS):
        outcomes: dict[RunKey, bool] = {}
        for key, is_good in _outcomes(session):
            outcomes[key.original] = outcomes.get(key.original, True) and is_good
        latest = {**outcomes, **latest}
    return frozenset(key for key, is_good in latest.items() if not is_good)


def _outcomes(session: Path) -> Iterator[tuple[RunKey, bool]]:
    """Yield (key, True if the outcome is good) of each finished run. Yield nothing for an invalid journal.

    Runs that were skipped or not finished are omitted, so that `last_failed` uses their outcome in an earlier session.
    """
    try:
        runs = read_journal(session).runs
    except InvalidInput:
        return
    for run in runs:
        if not run.result.is_unfinished and run.outcome is not Outcome.SKIPPED:
            yield run.key, run.outcome.is_good


def _session_time(session: Path) -> str:
    """Return the time at which run.json of the session was written (ISO 8601); "" if the time is unknown."""
    try:
        document = json.loads((session / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    return str(document.get("written", "")) if isinstance(document, dict) else ""
