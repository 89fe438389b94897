"""Reader of events.jsonl, the journal of a session, and conversion of runs and study plans to and from its lines."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from sys import intern
from typing import Any, TypeVar

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.run_result import INTERRUPTED, NOT_RUN, RunFailure, RunKey, error_result
from simscen.core.records.run_store import FinishedRuns, RunStore
from simscen.core.records.session_events import Artifacts, RunFinished, SessionStarted, session_started
from simscen.judge.result_json import from_data, read_key, result_data
from simscen.judge.study import StudyPlan
from simscen.model.acceptance import PassRate
from simscen.report.display_text import relative_path, relative_to_cwd

JOURNAL_FILE = "events.jsonl"
JOURNAL_FORMAT = 2
"""Version of the format of the journal. Journals with other versions are refused."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A run of a session, as planned before the run starts.

    Attributes:
        key: Scenario, variation, seed, and stack of the run.
        path: Scenario file relative to the root folder.
        digest: Hash of everything that the result depends on. A result is reused only if the digest is the same.
        again: Command that repeats the run.
        file: Scenario file relative to the working folder.
        stack: Value NAME=VALUE of the option --stack; "" for the stack of the scenario.
        definition: Hash of the scenario without its stacks, by which `simscen compare` detects a changed scenario.
        varied: Varied values, by the path of the parameter in the scenario.
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
    """Read the data of `planned_run_to_data`. Raises KeyError or TypeError if the data is invalid."""
    texts = {name: intern(data[name]) for name in ("path", "digest", "file")}
    texts |= {name: intern(data.get(name, "")) for name in ("stack", "definition")}
    return PlannedRun(read_key(data), **texts, again=data["again"], varied=data.get("varied", {}))


_STUDY_FIELDS = ("scenario", "is_random", "is_designed_in_pairs", "drawn", "stops_early")


def study_plan_to_data(plan: StudyPlan) -> dict[str, Any]:
    """Return the plan of a study as JSON data, without the varied values."""
    claim = None if plan.claim is None else plan.claim.model_dump(exclude_unset=True)
    return {"claim": claim, **{name: getattr(plan, name) for name in _STUDY_FIELDS}}


def _study_plan_from_data(data: dict[str, Any], planned: Sequence[PlannedRun]) -> StudyPlan:
    """Read the data of `study_plan_to_data`. The varied values are taken from the planned runs."""
    claim = None if data["claim"] is None else PassRate.model_validate(data["claim"])
    values = {run.key: run.varied for run in planned if run.varied}
    return StudyPlan(claim=claim, values=values, **{name: data[name] for name in _STUDY_FIELDS})


def finished_run_to_data(run: RunFinished, folder: Path) -> dict[str, Any]:
    """Return a finished run as JSON data. The paths of its files become relative to the output `folder`."""
    files = {name: relative_path(path, str(folder)) if path else "" for name, path in asdict(run.artifacts).items()}
    data = {"wall": run.wall, "again": run.again, "file": run.file, "tags": list(run.tags)}
    data |= {"resumed": True} if run.resumed else {}
    return {**data, "files": files, "result": result_data(run.result)}


def finished_run_from_data(data: dict[str, Any], folder: Path) -> RunFinished:
    """Read the data of `finished_run_to_data`, and prepend the output `folder` to the paths of the files.

    Raises KeyError, TypeError, or ValueError if the data is invalid.
    """
    files = {name: str(folder / path) if path else "" for name, path in data["files"].items()}
    result, tags = from_data(data["result"]), tuple(data.get("tags", ()))
    return RunFinished(
        result, data["wall"], Artifacts(**files), data["again"], data["file"], tags, resumed=data.get("resumed", False)
    )


AnyRun = TypeVar("AnyRun", PlannedRun, RunFinished)
"""A run that has the path `file` of its scenario."""


@dataclass(frozen=True)
class JournaledSession:
    """The last session in a journal.

    Attributes:
        version: Version of simscen that wrote the journal.
        workers: Number of worker processes.
        shard: (i, n): the session ran part i of n of the selected scenarios; (1, 1) for all of them.
        planned: All runs of the session in order.
        finished: Finished runs by key.
        started: Keys of all runs that started, finished or not.
        wall: Wall time in s from the start of the session to its end; to the last line if the session did not end.
        interrupted: Whether the session was interrupted, or has runs that are not finished.
        study: Plan of the study, for a session of `simscen study`; None for other sessions.
    """

    version: str
    workers: int
    shard: tuple[int, int]
    planned: tuple[PlannedRun, ...]
    finished: FinishedRuns
    started: frozenset[RunKey]
    wall: float
    interrupted: bool
    study: StudyPlan | None = None

    @property
    def runs(self) -> RunStore:
        """Results of all planned runs in order; the result of a run that was not finished is an error."""
        if len(self.finished) == len(self.planned):
            indices = (self.finished.index(run.key) for run in self.planned)
            return self.finished.store.select(index for index in indices if index is not None)
        return RunStore(self.finished.get(run.key) or self._unfinished(run) for run in self.planned)

    def start_event(self, folder: Path) -> SessionStarted:
        """Return the event with which the session starts, for reporters. `folder` is the output folder."""
        return session_started(self.version, [run.key for run in self.planned], self.workers, folder, self.stacks)

    @property
    def stacks(self) -> tuple[str, ...]:
        """NAME=VALUE of each stack that was chosen with --stack, in the order of the runs."""
        return tuple(dict.fromkeys(run.stack for run in self.planned if run.stack))

    def _unfinished(self, run: PlannedRun) -> RunFinished:
        """Return the result of a run that was not finished: the error `interrupted` or `not-run`."""
        has_started = run.key in self.started
        kind = INTERRUPTED if has_started else NOT_RUN
        failure = RunFailure(kind, f"simscen ended before the run {'was finished' if has_started else 'started'}")
        return RunFinished(error_result(run.key, run.path, failure, run.stack), again=run.again, file=run.file)


def read_journal(folder: Path) -> JournaledSession:
    """Read the last session of the journal in `folder`. Raises InvalidInput if there is no valid journal."""
    if not (folder / JOURNAL_FILE).is_file():
        hint = "use the output folder of `simscen run`, such as simscen-out/latest"
        message = f"the folder has no {JOURNAL_FILE}" if folder.is_dir() else "no such folder"
        raise _invalid_journal(folder, message, hint)
    try:
        lines = _last_session_lines(folder)
        first = next(lines, None)
        if first is None:
            raise _invalid_journal(folder / JOURNAL_FILE, "the session ended before it listed its runs")
        session = _SessionReader(first, folder)
        for line in lines:
            session.read(line)
        return session.result()
    except OSError as error:
        raise _invalid_journal(folder / JOURNAL_FILE, f"cannot read the journal: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        raise _invalid_journal(folder / JOURNAL_FILE, f"the journal is damaged: {error}") from error


def _last_session_lines(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the complete lines of the last session in a journal. Raises OSError or ValueError if it is not readable."""
    with (folder / JOURNAL_FILE).open("rb") as file:
        start, position = None, 0
        for line in file:
            # The text "planned" can also be part of a name, so the line must be parsed.
            if b'"planned"' in line and line.endswith(b"\n") and json.loads(line)["event"] == "planned":
                start = position
            position += len(line)
        file.seek(start or 0)
        for line in file:
            message = json.loads(line) if line.endswith(b"\n") else None
            if message is not None and start is not None:
                yield message


def session_process(folder: Path) -> int | None:
    """Return the ID of the process that wrote the last session; None if the journal has no readable session."""
    try:
        first = next(_last_session_lines(folder), None)
        return None if first is None else int(first["pid"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


class _SessionReader:
    """Reads the lines of one session.

    `first` is the first line of the session, which has the planned runs. `folder` is the output folder. Raises
    InvalidInput if the journal has another format.
    """

    def __init__(self, first: dict[str, Any], folder: Path) -> None:
        if first["format"] != JOURNAL_FORMAT:
            message = f"the journal has format {first['format']}; this version of simscen reads format {JOURNAL_FORMAT}"
            raise _invalid_journal(folder / JOURNAL_FILE, message)
        self._first, self._last, self._folder = {**first, "runs": None}, first, folder
        self._cwd = first.get("cwd", "")
        self._study = first.get("study")
        self._planned: list[PlannedRun] = []
        self._add_planned(first["runs"])
        self._finished = FinishedRuns()
        self._started: set[RunKey] = set()

    def read(self, line: dict[str, Any]) -> None:
        """Read a line after the first one."""
        match line["event"]:
            case "added":
                self._add_planned(line["runs"])
                self._study = line.get("study")
            case "started":
                self._started.add(self._planned[line["run"]].key)
            case "finished":
                run = _relocate(finished_run_from_data(line, self._folder), self._cwd)
                self._finished.add(self._planned[line["run"]].key, run)
        self._last = {key: line[key] for key in ("wall", "at", "interrupted") if key in line}

    def _add_planned(self, runs: list[dict[str, Any]]) -> None:
        self._planned += [_relocate(planned_run_from_data(run), self._cwd) for run in runs]

    def result(self) -> JournaledSession:
        """Return the session from the lines read so far."""
        planned, first, last = tuple(self._planned), self._first, self._last
        return JournaledSession(
            version=first["version"],
            workers=first["workers"],
            shard=tuple(first.get("shard", (1, 1))),
            planned=planned,
            finished=self._finished,
            started=frozenset(self._started),
            wall=last.get("wall", last["at"]),
            interrupted=len(self._finished) < len(planned) or bool(last.get("interrupted")),
            study=None if self._study is None else _study_plan_from_data(self._study, planned),
        )


def _relocate(run: AnyRun, cwd: str) -> AnyRun:
    """Return the run with the path `file` relative to the current working folder instead of the folder `cwd`."""
    return replace(run, file=intern(relative_to_cwd(run.file, cwd)))


def _invalid_journal(path: Path, message: str, hint: str = "") -> InvalidInput:
    return InvalidInput([Problem(str(path), 0, 0, "SC810", message, hint)])
