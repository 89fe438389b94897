"""Runs as lines of the journal, and back."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.run_result import RunFailure, RunKey, error_result
from simscen.core.records.session_events import Artifacts, RunFinished, SessionStarted, session_started
from simscen.judge.result_json import from_data, read_key, result_data
from simscen.report.display_text import relative_to_cwd
from simscen.report.results_json import relative

JOURNAL_FILE = "events.jsonl"
JOURNAL_FORMAT = 2


@dataclass(frozen=True)
class PlannedRun:
    """A run that a session has taken on; `path` is the scenario's file.

    `digest` changes with everything the run depends on, so that an old answer is not kept for a new question. `again`
    and `file` are as in RunFinished; they depend on where the session was started, which is no other question. `stack`
    is as in RunResult; what it stands for is in the digest.
    """

    key: RunKey
    path: str
    digest: str = ""
    again: str = field(default="", compare=False)
    file: str = field(default="", compare=False)
    stack: str = field(default="", compare=False)


def planned_run_to_data(run: PlannedRun) -> dict[str, Any]:
    """A planned run as plain data."""
    where = {"path": run.path, "file": run.file, "again": run.again, "stack": run.stack}
    return {**asdict(run.key), **where, "digest": run.digest}


def planned_run_from_data(data: dict[str, Any]) -> PlannedRun:
    """The run that `planned_data` described. Raises KeyError or TypeError when it is none."""
    return PlannedRun(read_key(data), data["path"], data["digest"], data["again"], data["file"], data.get("stack", ""))


def finished_run_to_data(run: RunFinished, folder: Path) -> dict[str, Any]:
    """An answer as plain data: its result.json and what that leaves out. Files are relative to `folder`."""
    files = {name: relative(path, str(folder)) if path else "" for name, path in asdict(run.artifacts).items()}
    about = {"wall": run.wall, "again": run.again, "file": run.file, "tags": list(run.tags)}
    about |= {"resumed": True} if run.resumed else {}
    return {**about, "files": files, "result": result_data(run.result)}


def finished_run_from_data(data: dict[str, Any], folder: Path) -> RunFinished:
    """The answer that `run_data` described, its files now in `folder`. Raises KeyError, TypeError or ValueError."""
    files = {name: str(folder / path) if path else "" for name, path in data["files"].items()}
    result, tags = from_data(data["result"]), tuple(data.get("tags", ()))
    return RunFinished(
        result, data["wall"], Artifacts(**files), data["again"], data["file"], tags, resumed=data.get("resumed", False)
    )


Run = TypeVar("Run", PlannedRun, RunFinished)


@dataclass(frozen=True)
class JournaledSession:
    """The last session in a journal: what it planned, what was answered, and which runs had at least begun.

    `wall` is how many seconds after its start the last line was written.
    """

    version: str
    workers: int
    planned: tuple[PlannedRun, ...]
    answered: Mapping[RunKey, RunFinished]
    begun: frozenset[RunKey]
    wall: float
    interrupted: bool

    @property
    def answers(self) -> list[RunFinished]:
        """An answer for every planned run: an error where simscen ended before there was one."""
        return [self.answered.get(run.key) or self._unanswered(run) for run in self.planned]

    def started(self, folder: Path) -> SessionStarted:
        """The event that the session began with."""
        return session_started(self.version, [run.key for run in self.planned], self.workers, folder, self.stacks)

    @property
    def stacks(self) -> tuple[str, ...]:
        """The NAME=VALUE of each stack that was chosen, in their order."""
        return tuple(dict.fromkeys(run.stack for run in self.planned if run.stack))

    def _unanswered(self, run: PlannedRun) -> RunFinished:
        kind = "interrupted" if run.key in self.begun else "not-run"
        why = "before it was finished" if run.key in self.begun else "before it began"
        failure = RunFailure(kind, f"simscen ended {why}")
        return RunFinished(error_result(run.key, run.path, failure, run.stack), again=run.again, file=run.file)


def read_journal(folder: Path) -> JournaledSession:
    """The last session of the journal in `folder`. Raises InvalidInput when there is none that can be understood."""
    if not (folder / JOURNAL_FILE).is_file():
        hint = "name the folder that `simscen run` wrote, e.g. simscen-out/latest"
        raise _invalid(folder, f"there is no {JOURNAL_FILE} in it", hint)
    try:
        lines = last_session_lines(folder)
        if not lines:
            raise _invalid(folder / JOURNAL_FILE, "the session ended before it had planned its runs")
        return _parse_session(lines, folder)
    except OSError as error:
        raise _invalid(folder / JOURNAL_FILE, f"cannot read the journal: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise _invalid(folder / JOURNAL_FILE, f"the journal is damaged: {error}") from error


def last_session_lines(folder: Path) -> list[dict[str, Any]]:
    """The lines of the last session; a last line that was cut short is not one. Raises OSError or ValueError."""
    whole = (folder / JOURNAL_FILE).read_bytes().split(b"\n")[:-1]
    lines = [json.loads(line) for line in whole]
    starts = [number for number, line in enumerate(lines) if line["event"] == "planned"]
    return lines[starts[-1] :] if starts else []


def _parse_session(lines: list[dict[str, Any]], folder: Path) -> JournaledSession:
    first = lines[0]
    if first["format"] != JOURNAL_FORMAT:
        raise ValueError(f"it has format {first['format']}; this version reads {JOURNAL_FORMAT}")
    cwd = first.get("cwd", "")
    planned = tuple(_relocate(planned_run_from_data(run), cwd) for run in first["runs"])
    answered: dict[RunKey, RunFinished] = {}
    begun: set[RunKey] = set()
    for line in lines[1:]:
        if line["event"] == "started":
            begun.add(planned[line["run"]].key)
        elif line["event"] == "finished":
            key = planned[line["run"]].key
            answered[key] = _relocate(finished_run_from_data(line, folder), cwd)
    last = lines[-1]
    return JournaledSession(
        version=first["version"],
        workers=first["workers"],
        planned=planned,
        answered=answered,
        begun=frozenset(begun),
        wall=last["at"],
        interrupted=len(answered) < len(planned) or bool(last.get("interrupted")),
    )


def _relocate(run: Run, cwd: str) -> Run:
    """The run with its scenario's file as seen from where we are now, not from where the session was."""
    return replace(run, file=relative_to_cwd(run.file, cwd))


def _invalid(path: Path, message: str, hint: str = "") -> InvalidInput:
    return InvalidInput([Problem(str(path), 0, 0, "SC810", message, hint)])


MAX_SESSIONS = 50
"""So many sessions are looked back on."""
UNDECIDED_KINDS = frozenset({"interrupted", "not-run"})
"""Kinds of runs that say nothing of their scenario; the session before them does."""


@dataclass(frozen=True)
class LastFailed:
    """The `runs` whose latest outcome was none as it should be, and the newest session's `folder`."""

    folder: Path
    runs: frozenset[RunKey]


def sessions_in(folder: Path) -> list[Path]:
    """The output folders of sessions below `folder`, the newest first; links such as `latest` are left out."""
    if not folder.is_dir():
        return []
    found = [each for each in folder.iterdir() if (each / JOURNAL_FILE).is_file() and not each.is_symlink()]
    return sorted(
        found, key=lambda each: (_written(each), (each / JOURNAL_FILE).stat().st_mtime_ns, each.name), reverse=True
    )


def last_failed(folder: Path) -> LastFailed | None:
    """What failed when it was run last, in any of the sessions of `folder`, as pytest remembers it; None = no session.

    A run that later sessions left out is still as it was then.
    """
    sessions = sessions_in(folder)
    if not sessions:
        return None
    known: dict[RunKey, bool] = {}
    for session in islice(sessions, MAX_SESSIONS):
        found: dict[RunKey, bool] = {}
        for key, good in _outcomes(session):
            found[key.first] = found.get(key.first, True) and good
        known = {**found, **known}
    return LastFailed(sessions[0], frozenset(key for key, good in known.items() if not good))


def _outcomes(session: Path) -> Iterator[tuple[RunKey, bool]]:
    """Each run that came to an end, and whether as it should; none of a journal that cannot be read."""
    try:
        answers = read_journal(session).answers
    except InvalidInput:
        return
    for answer in answers:
        if answer.result.error is None or answer.result.error.kind not in UNDECIDED_KINDS:
            yield answer.key, answer.outcome.good


def _written(session: Path) -> str:
    """When run.json says that it was, in ISO 8601; "" where it does not."""
    try:
        document = json.loads((session / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    return str(document.get("written", "")) if isinstance(document, dict) else ""
