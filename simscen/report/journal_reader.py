"""Reader of events.jsonl, the journal of a session, and the format of its lines."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.run_result import RunFailure, RunKey, error_result
from simscen.core.records.session_events import Artifacts, RunFinished, SessionStarted, session_started
from simscen.judge.result_json import from_data, read_key, result_data
from simscen.judge.study import StudyPlan
from simscen.model.acceptance import PassRate
from simscen.report.display_text import relative_to_cwd
from simscen.report.results_json import relative

JOURNAL_FILE = "events.jsonl"
JOURNAL_FORMAT = 2


@dataclass(frozen=True)
class PlannedRun:
    """A run of a session that may not have started yet. `path` is the scenario file.

    `digest` is a hash of everything that the result depends on, so that a result is reused only if nothing has changed;
    `definition` is one of the scenario without its stacks, so that versions of a stack can be compared.
    `again` and `file` have the same meaning as in RunFinished, `stack` as in RunResult. `varied` are the varied values
    by path.
    """

    key: RunKey
    path: str
    digest: str = ""
    again: str = field(default="", compare=False)
    file: str = field(default="", compare=False)
    stack: str = field(default="", compare=False)
    definition: str = field(default="", compare=False)
    varied: Mapping[str, Any] = field(default_factory=dict, compare=False)


def planned_run_to_data(run: PlannedRun) -> dict[str, Any]:
    """Return a planned run as JSON data."""
    source = {"path": run.path, "file": run.file, "again": run.again, "stack": run.stack, "definition": run.definition}
    varied = {"varied": dict(run.varied)} if run.varied else {}
    return {**asdict(run.key), **source, "digest": run.digest, **varied}


def planned_run_from_data(data: dict[str, Any]) -> PlannedRun:
    """Read the data of `planned_run_to_data`. Raises KeyError or TypeError if they are invalid."""
    stack, definition = data.get("stack", ""), data.get("definition", "")
    return PlannedRun(
        read_key(data),
        data["path"],
        data["digest"],
        data["again"],
        data["file"],
        stack,
        definition,
        data.get("varied", {}),
    )


def study_plan_to_data(plan: StudyPlan) -> dict[str, Any]:
    """Return a plan as JSON data, without the values, which the planned runs have."""
    claim = None if plan.claim is None else plan.claim.model_dump(exclude_unset=True)
    return {
        "scenario": plan.scenario,
        "is_random": plan.is_random,
        "claim": claim,
        "is_designed_in_pairs": plan.is_designed_in_pairs,
        "drawn": plan.drawn,
        "stops_early": plan.stops_early,
    }


def _study_plan_from_data(data: dict[str, Any], planned: Sequence[PlannedRun]) -> StudyPlan:
    claim = None if data["claim"] is None else PassRate.model_validate(data["claim"])
    values = {run.key: run.varied for run in planned if run.varied}
    return StudyPlan(
        data["scenario"],
        data["is_random"],
        claim,
        values,
        data["is_designed_in_pairs"],
        data["drawn"],
        data["stops_early"],
    )


def finished_run_to_data(run: RunFinished, folder: Path) -> dict[str, Any]:
    """Return a finished run as JSON data, with files relative to `folder`."""
    files = {name: relative(path, str(folder)) if path else "" for name, path in asdict(run.artifacts).items()}
    data = {"wall": run.wall, "again": run.again, "file": run.file, "tags": list(run.tags)}
    data |= {"resumed": True} if run.resumed else {}
    return {**data, "files": files, "result": result_data(run.result)}


def finished_run_from_data(data: dict[str, Any], folder: Path) -> RunFinished:
    """Read the data of `finished_run_to_data`, with files in `folder`. Raises KeyError, TypeError or ValueError."""
    files = {name: str(folder / path) if path else "" for name, path in data["files"].items()}
    result, tags = from_data(data["result"]), tuple(data.get("tags", ()))
    return RunFinished(
        result, data["wall"], Artifacts(**files), data["again"], data["file"], tags, resumed=data.get("resumed", False)
    )


Run = TypeVar("Run", PlannedRun, RunFinished)


@dataclass(frozen=True)
class JournaledSession:
    """The last session in a journal.

    Attributes:
        shard: Which part (i, n) of the selected scenarios it ran.
        planned: All runs of the session.
        finished: Finished runs by key.
        started: Runs that had at least started.
        wall: Seconds from the start of the session to its end, or to the last line if it did not end.
        interrupted: Whether the session ended before all runs were finished.
        study: Plan of a session of `simscen study`.
    """

    version: str
    workers: int
    shard: tuple[int, int]
    planned: tuple[PlannedRun, ...]
    finished: Mapping[RunKey, RunFinished]
    started: frozenset[RunKey]
    wall: float
    interrupted: bool
    study: StudyPlan | None = None

    @property
    def runs(self) -> list[RunFinished]:
        """All planned runs; those that were not finished have an error."""
        return [self.finished.get(run.key) or self._unfinished(run) for run in self.planned]

    def start_event(self, folder: Path) -> SessionStarted:
        """Return the event at the start of the session."""
        return session_started(self.version, [run.key for run in self.planned], self.workers, folder, self.stacks)

    @property
    def stacks(self) -> tuple[str, ...]:
        """NAME=VALUE of each stack that was chosen, in order."""
        return tuple(dict.fromkeys(run.stack for run in self.planned if run.stack))

    def _unfinished(self, run: PlannedRun) -> RunFinished:
        has_started = run.key in self.started
        kind = "interrupted" if has_started else "not-run"
        failure = RunFailure(kind, f"simscen ended before the run {'was finished' if has_started else 'started'}")
        return RunFinished(error_result(run.key, run.path, failure, run.stack), again=run.again, file=run.file)


def read_journal(folder: Path) -> JournaledSession:
    """Read the last session of the journal in `folder`. Raises InvalidInput if there is no valid one."""
    if not (folder / JOURNAL_FILE).is_file():
        hint = "name the folder that `simscen run` wrote, e.g. simscen-out/latest"
        raise _invalid(folder, f"the folder has no {JOURNAL_FILE}", hint)
    try:
        lines = last_session_lines(folder)
        if not lines:
            raise _invalid(folder / JOURNAL_FILE, "the session ended before it listed its runs")
        return _parse_session(lines, folder)
    except OSError as error:
        raise _invalid(folder / JOURNAL_FILE, f"cannot read the journal: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise _invalid(folder / JOURNAL_FILE, f"the journal is damaged: {error}") from error


def last_session_lines(folder: Path) -> list[dict[str, Any]]:
    """Return the complete lines of the last session. Raises OSError or ValueError."""
    complete = (folder / JOURNAL_FILE).read_bytes().split(b"\n")[:-1]
    lines = [json.loads(line) for line in complete]
    starts = [number for number, line in enumerate(lines) if line["event"] == "planned"]
    return lines[starts[-1] :] if starts else []


def _parse_session(lines: list[dict[str, Any]], folder: Path) -> JournaledSession:
    first = lines[0]
    if first["format"] != JOURNAL_FORMAT:
        raise ValueError(f"it has format {first['format']}; this version reads {JOURNAL_FORMAT}")
    cwd = first.get("cwd", "")
    added = [line for line in lines[1:] if line["event"] == "added"]
    planned = tuple(_relocate(planned_run_from_data(run), cwd) for line in (first, *added) for run in line["runs"])
    study = (added[-1] if added else first).get("study")
    finished: dict[RunKey, RunFinished] = {}
    started: set[RunKey] = set()
    for line in lines[1:]:
        if line["event"] == "started":
            started.add(planned[line["run"]].key)
        elif line["event"] == "finished":
            key = planned[line["run"]].key
            finished[key] = _relocate(finished_run_from_data(line, folder), cwd)
    last = lines[-1]
    return JournaledSession(
        version=first["version"],
        workers=first["workers"],
        shard=tuple(first.get("shard", (1, 1))),
        planned=planned,
        finished=finished,
        started=frozenset(started),
        wall=last.get("wall", last["at"]),
        interrupted=len(finished) < len(planned) or bool(last.get("interrupted")),
        study=None if study is None else _study_plan_from_data(study, planned),
    )


def _relocate(run: Run, cwd: str) -> Run:
    """Return the run with the path of its scenario file relative to the current working folder."""
    return replace(run, file=relative_to_cwd(run.file, cwd))


def _invalid(path: Path, message: str, hint: str = "") -> InvalidInput:
    return InvalidInput([Problem(str(path), 0, 0, "SC810", message, hint)])


MAX_SESSIONS = 50
"""Maximum number of sessions to search for failures."""
UNDECIDED_KINDS = frozenset({"interrupted", "not-run"})
"""Kinds of errors after which the outcome of the previous session still counts."""


@dataclass(frozen=True)
class LastFailed:
    """The `runs` whose latest outcome was a failure, and the `folder` of the newest session."""

    folder: Path
    runs: frozenset[RunKey]


def sessions_in(folder: Path) -> list[Path]:
    """Return the output folders of sessions in `folder`, newest first, without links such as `latest`."""
    if not folder.is_dir():
        return []
    sessions = [each for each in folder.iterdir() if (each / JOURNAL_FILE).is_file() and not each.is_symlink()]
    return sorted(
        sessions, key=lambda each: (_written(each), (each / JOURNAL_FILE).stat().st_mtime_ns, each.name), reverse=True
    )


def last_failed(folder: Path) -> LastFailed | None:
    """Return the runs that failed when they were last run in a session of `folder`, or None without any session."""
    sessions = sessions_in(folder)
    if not sessions:
        return None
    known: dict[RunKey, bool] = {}
    for session in islice(sessions, MAX_SESSIONS):
        outcomes: dict[RunKey, bool] = {}
        for key, good in _outcomes(session):
            outcomes[key.first] = outcomes.get(key.first, True) and good
        known = {**outcomes, **known}
    return LastFailed(sessions[0], frozenset(key for key, good in known.items() if not good))


def _outcomes(session: Path) -> Iterator[tuple[RunKey, bool]]:
    """Yield each finished run and whether it had the desired outcome. Yields nothing for an invalid journal."""
    try:
        runs = read_journal(session).runs
    except InvalidInput:
        return
    for run in runs:
        if run.result.error is None or run.result.error.kind not in UNDECIDED_KINDS:
            yield run.key, run.outcome.good


def _written(session: Path) -> str:
    """Return the time of the session from run.json (ISO 8601), or "" if it is unknown."""
    try:
        document = json.loads((session / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    return str(document.get("written", "")) if isinstance(document, dict) else ""
