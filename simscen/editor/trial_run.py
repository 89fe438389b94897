"""Run the text of the editor once, in a process of its own, without saving it."""

import shutil
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.errors import SimscenError
from simscen.core.records.run_result import RunResult
from simscen.core.records.session_events import RunProgress, SessionEvent
from simscen.loading.loaded import LoadedScenario
from simscen.report.display_text import one_line
from simscen.run.process.jobs import Backend, Job, ReplayMode
from simscen.run.sessions.run_session import SessionOptions, run_session

WALL_LIMIT_S = 300.0
END_S = 5.0
"""How long to wait for a run that was stopped; its process ends with this one at the latest."""
REPLAY = "replay.html"


class _Canceled(Exception):
    """The person at the page stopped the run."""


@dataclass
class Trial:
    """One run: its progress in simulated seconds, then its verdicts."""

    number: int
    folder: Path
    limit: float
    seconds: float = 0.0
    state: str = "running"
    message: str = ""
    verdicts: list[dict[str, Any]] = field(default_factory=list)
    is_canceled: bool = False

    def data(self) -> dict[str, Any]:
        """Return the state as JSON data; `replay`: whether there is a replay page."""
        return {
            "run": self.number,
            "state": self.state,
            "seconds": self.seconds,
            "limit": self.limit,
            "message": self.message,
            "verdicts": self.verdicts,
            "replay": self.state != "running" and self.replay.is_file(),
        }

    @property
    def replay(self) -> Path:
        """The replay page of the run."""
        return self.folder / REPLAY


class TrialRuns:
    """Runs texts one after the other, in a temporary folder that is deleted at the end."""

    def __init__(self, backend_factory: Callable[[], Backend]) -> None:
        self._backend_factory = backend_factory
        self._folder: Path | None = None
        self._trials: list[Trial] = []
        self._lock = threading.Lock()

    def start(self, loaded: LoadedScenario) -> Trial:
        """Start a run, and cancel the one before."""
        for trial in self._trials:
            trial.is_canceled = True
        self._folder = self._folder or Path(tempfile.mkdtemp(prefix="simscen-edit-"))
        number = len(self._trials) + 1
        trial = Trial(number, self._folder / str(number), loaded.spec.time_limit)
        self._trials.append(trial)
        threading.Thread(target=self._run, args=(loaded, trial), daemon=True).start()
        return trial

    def trial(self, number: int) -> Trial | None:
        """Return a run by its number from 1."""
        return self._trials[number - 1] if 0 < number <= len(self._trials) else None

    def close(self) -> None:
        """Cancel all runs and delete their files."""
        for trial in self._trials:
            trial.is_canceled = True
        has_ended = self._lock.acquire(timeout=END_S)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        if has_ended:
            self._lock.release()

    def _run(self, loaded: LoadedScenario, trial: Trial) -> None:
        def listen(event: SessionEvent) -> None:
            if trial.is_canceled:
                raise _Canceled
            if isinstance(event, RunProgress):
                trial.seconds = event.simulated

        job = Job(0, loaded, loaded.key(loaded.spec.seed), trial.folder, WALL_LIMIT_S, ReplayMode.ALL)
        try:
            with self._lock, self._backend_factory() as backend:
                answers, _ = run_session([job], SessionOptions(), backend, listen)
            self._finish(trial, answers[0].result)
        except _Canceled:
            trial.state, trial.message = "canceled", "the run was stopped"
        except (SimscenError, OSError) as error:
            trial.state, trial.message = "error", one_line(str(error))

    def _finish(self, trial: Trial, result: RunResult) -> None:
        lines = result.lines or (0,) * len(result.verdicts)
        for verdict, line in zip(result.verdicts, lines, strict=False):
            finding = verdict.tightest
            text = "" if finding is None else f"{one_line(finding.measured)} (limit {one_line(finding.limit)})"
            status = verdict.status.value
            trial.verdicts.append({"id": one_line(verdict.id), "status": status, "text": text, "line": line})
        trial.message = one_line(result.error.message if result.error else result.ended)
        trial.seconds = result.simulated
        trial.state = result.outcome.value
