"""Writer of events.jsonl, the journal of a session, from which all other reports can be generated.

The first line of a session lists its planned runs. Each further line records an event: a run started or finished, runs
were added to a study, or the session ended.
"""

import fcntl
import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simscen.core.errors import UsageError
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished, RunStarted, SessionEvent, SessionFinished
from simscen.judge.study import StudyPlan
from simscen.report.journal_reader import (
    JOURNAL_FILE,
    JOURNAL_FORMAT,
    PlannedRun,
    finished_run_to_data,
    planned_run_to_data,
    session_process,
    study_plan_to_data,
)

BLOCK_BYTES = 1 << 20
"""Size of the blocks in which a journal is read backward to find its last line break."""


class Journal:
    """Writes the events of a session to events.jsonl in `folder`, and locks this folder until `close`.

    With `resume`, lines are appended to an existing journal. With `sync`, each line is flushed to the disk, so that the
    line survives a crash of the machine. If a line cannot be written, for example because the disk is full, `error` is
    the exception; otherwise None.

    Raises UsageError if another process has locked the folder, or if a journal exists and `resume` is false. Raises
    OSError if the file cannot be opened.
    """

    def __init__(self, folder: Path, resume: bool = False, sync: bool = True) -> None:
        self.folder = folder
        self.error: OSError | None = None
        self._sync = sync
        self._file = os.open(folder / JOURNAL_FILE, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            _lock(self._file, folder)
            if _truncate_to_complete_lines(self._file) and not resume:
                raise UsageError(f"the output folder {folder} already contains a session; nothing in it was changed")
        except (UsageError, OSError):
            self.close()
            raise
        self._numbers: dict[RunKey, int] = {}
        self._finished: set[RunKey] = set()
        self._start = time.monotonic()

    def plan(
        self,
        runs: Sequence[PlannedRun],
        version: str,
        workers: int,
        shard: tuple[int, int] = (1, 1),
        study: StudyPlan | None = None,
    ) -> None:
        """Write the first line of a session with these runs. Readers ignore all earlier lines of the journal.

        `version` is the version of simscen. `workers` is the number of worker processes. `shard` (i, n) means that
        `runs` is part i of n of all runs. `study` is the plan of a study; None for other sessions.
        """
        self._numbers, self._finished = {run.key: number for number, run in enumerate(runs)}, set()
        facts = {
            "format": JOURNAL_FORMAT,
            "version": version,
            "workers": workers,
            "shard": list(shard),
            "pid": os.getpid(),
            "cwd": str(Path.cwd()),
            **({} if study is None else {"study": study_plan_to_data(study)}),
        }
        self._write({"event": "planned", **facts, "runs": [planned_run_to_data(run) for run in runs]})

    def add(self, runs: Sequence[PlannedRun], version: str, workers: int, study: StudyPlan) -> None:
        """Write a line with the next runs of a study. The first call writes the line of `plan`.

        `study` is the plan of the study, including these runs. The other parameters are as in `plan`.
        """
        first = len(self._numbers)
        if not first:
            self.plan(runs, version, workers, study=study)
            return
        self._numbers |= {run.key: number for number, run in enumerate(runs, start=first)}
        data = [planned_run_to_data(run) for run in runs]
        self._write({"event": "added", "runs": data, "study": study_plan_to_data(study)})

    def __call__(self, event: SessionEvent) -> None:
        """Write a line for a started or finished run, and for the end of the session."""
        match event:
            case RunStarted():
                self._write({"event": "started", "run": self._numbers[event.key]})
            case RunFinished():
                data = finished_run_to_data(event, self.folder)
                if self._write({"event": "finished", "run": self._numbers[event.key], **data}):
                    self._finished.add(event.key)
            case SessionFinished():
                self._write({"event": "ended", "interrupted": event.interrupted, "wall": round(event.wall, 3)})
            case _:
                pass

    def complete(self, runs: Sequence[RunFinished]) -> None:
        """Write the finished runs that are not in the journal yet, after an interrupt or a full disk."""
        for run in runs:
            if run.key not in self._finished:
                self(run)

    def close(self) -> None:
        """Close the file and unlock the folder."""
        os.close(self._file)

    def _write(self, message: dict[str, Any]) -> bool:
        """Append `message` and the seconds since the start as a line. Set `error` and return False if that fails."""
        message = {**message, "at": round(time.monotonic() - self._start, 3)}
        data = json.dumps(message, sort_keys=True, ensure_ascii=True, allow_nan=False).encode() + b"\n"
        size = os.fstat(self._file).st_size
        try:
            unwritten = memoryview(data)
            while unwritten:  # on a full disk, os.write first writes only a part, and the next call raises the error
                unwritten = unwritten[os.write(self._file, unwritten) :]
            if self._sync:
                os.fdatasync(self._file)
        except OSError as error:
            self.error = error
            os.ftruncate(self._file, size)
            return False
        return True


def _truncate_to_complete_lines(file: int) -> int:
    """Remove an incomplete last line, as a killed process leaves it, and return the remaining size in bytes."""
    full_size = size = os.fstat(file).st_size
    while size:
        start = max(0, size - BLOCK_BYTES)
        end = os.pread(file, size - start, start).rfind(b"\n") + 1
        size = start + end
        if end:
            break
    if size < full_size:
        os.ftruncate(file, size)
    return size


def require_unlocked(folder: Path) -> None:
    """Raise UsageError if another process has locked the journal in `folder`."""
    if (folder / JOURNAL_FILE).is_file():
        file = os.open(folder / JOURNAL_FILE, os.O_RDONLY)
        try:
            _lock(file, folder)
        finally:
            os.close(file)


def _lock(file: int, folder: Path) -> None:
    """Lock the journal until the descriptor `file` is closed. Raises UsageError if another process has locked it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        pid = session_process(folder)
        process = "" if pid is None else f" by pid {pid}"
        raise UsageError(f"the output folder {folder} is in use{process}") from None
