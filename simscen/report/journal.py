"""events.jsonl: what happened in a session, one line each, kept even when simscen itself is killed.

The first line of a session lists all its runs; each later one says that a run began or how it ended, and is on the
disk before the session goes on. Everything else in the output folder can be made from it again.
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
from simscen.report.journal_reader import (
    JOURNAL_FILE,
    JOURNAL_FORMAT,
    PlannedRun,
    finished_run_to_data,
    last_session_lines,
    planned_run_to_data,
)


class Journal:
    """Listens to a session in `folder` and writes it down; holds the folder's lock until its process ends.

    With `goes_on` the folder may hold a journal already. Raises UsageError when the folder is another session's,
    OSError when the file cannot be opened. When a line cannot be written later, `error` says why and the runs go on:
    there may be room again, and the reports still come.
    """

    def __init__(self, folder: Path, goes_on: bool = False) -> None:
        self.folder = folder
        self.error: OSError | None = None
        self._file = os.open(folder / JOURNAL_FILE, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        _lock(self._file, folder)
        if _whole_lines(self._file) and not goes_on:
            raise UsageError(f"the output folder {folder} holds a session already; nothing in it was touched")
        self._numbers: dict[RunKey, int] = {}
        self._answered: set[RunKey] = set()
        self._begun = time.monotonic()

    def plan(self, runs: Sequence[PlannedRun], version: str, workers: int) -> None:
        """Open a session of these runs; what stood in the journal before no longer counts."""
        self._numbers, self._answered = {run.key: number for number, run in enumerate(runs)}, set()
        facts = {
            "format": JOURNAL_FORMAT,
            "version": version,
            "workers": workers,
            "pid": os.getpid(),
            "cwd": str(Path.cwd()),
        }
        self._write({"event": "planned", **facts, "runs": [planned_run_to_data(run) for run in runs]})

    def __call__(self, event: SessionEvent) -> None:
        """Write down what must not be lost."""
        match event:
            case RunStarted():
                self._write({"event": "started", "run": self._numbers[event.key]})
            case RunFinished():
                answer = {
                    "event": "finished",
                    "run": self._numbers[event.key],
                    **finished_run_to_data(event, self.folder),
                }
                if self._write(answer):
                    self._answered.add(event.key)
            case SessionFinished():
                self._write({"event": "ended", "interrupted": event.interrupted})
            case _:
                pass

    def complete(self, answers: Sequence[RunFinished]) -> None:
        """Write down the answers that are missing: an interrupt or a full disk may have come between."""
        for answer in answers:
            if answer.key not in self._answered:
                self(answer)

    def close(self) -> None:
        """Let go of the folder."""
        os.close(self._file)

    def _write(self, message: dict[str, Any]) -> bool:
        message = {**message, "at": round(time.monotonic() - self._begun, 3)}
        data = json.dumps(message, sort_keys=True, ensure_ascii=True, allow_nan=False).encode() + b"\n"
        size = os.fstat(self._file).st_size
        try:
            written = os.write(self._file, data)
            if written < len(data):  # the disk is full: say so, as the rest of the line would
                os.write(self._file, data[written:])
            os.fdatasync(self._file)
        except OSError as error:
            self.error = error
            os.ftruncate(self._file, size)
            return False
        return True


def _whole_lines(file: int) -> int:
    """Cut off what a killed writer left of its last line; the size of the rest."""
    data = os.pread(file, os.fstat(file).st_size, 0)
    size = data.rfind(b"\n") + 1
    if size < len(data):
        os.ftruncate(file, size)
    return size


def require_free(folder: Path) -> None:
    """Raise UsageError when a session is under way in `folder`."""
    if (folder / JOURNAL_FILE).is_file():
        file = os.open(folder / JOURNAL_FILE, os.O_RDONLY)
        try:
            _lock(file, folder)
        finally:
            os.close(file)


def _lock(file: int, folder: Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lines = last_session_lines(folder)
        by = f" by pid {lines[0]['pid']}" if lines else ""
        raise UsageError(f"the output folder {folder} is in use{by}") from None
