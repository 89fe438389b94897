"""Trial runs of the text in the editor, saved or not."""

import shutil
import tempfile
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.errors import SimscenError
from simscen.core.records.run_result import RunResult
from simscen.core.records.session_events import RunProgress, SessionEvent
from simscen.loading.loaded import LoadedScenario
from simscen.report.display_text import one_line
from simscen.run.kept_files import OutcomeFilter
from simscen.run.process.jobs import Backend, Job
from simscen.run.sessions.run_session import SessionOptions, run_session

WALL_LIMIT_S = 300.0
"""Maximum wall time of a run."""
STOP_TIMEOUT_S = 5.0
"""Maximum wall time to wait for a run to stop."""


class _Canceled(Exception):
    """The user stopped the run."""


@dataclass
class TrialRun:
    """Trial run with its state, which is updated during the run.

    Attributes:
        number: Number of the run, starting at 1.
        folder: Folder with the files of the run.
        limit: Maximum simulated time in s.
        seconds: Simulated time so far in s.
        state: "running", then the outcome of the run, "canceled", or "error".
        message: Reason of the end or error message; "" during the run.
        verdicts: Verdicts after the run, each with `id`, `status`, `text`, and `line`.
        is_canceled: Whether the run must stop.
    """

    number: int
    folder: Path
    limit: float
    seconds: float = 0.0
    state: str = "running"
    message: str = ""
    verdicts: list[dict[str, Any]] = field(default_factory=list)
    is_canceled: bool = False

    def data(self) -> dict[str, Any]:
        """Return the state as JSON data. The key `replay` states whether the replay page exists."""
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
        """Path of the replay page of the run."""
        return self.folder / "replay.html"


class TrialRuns:
    """All trial runs of an editor session, which are executed one after the other.

    `backend_factory` creates the backend that starts the process of a run.
    """

    def __init__(self, backend_factory: Callable[[], Backend]) -> None:
        self._backend_factory = backend_factory
        self._folder: Path | None = None
        self._trials: list[TrialRun] = []
        self._start_lock = threading.Lock()
        self._run_lock = threading.Lock()  # held by the run in progress

    def start(self, loaded: LoadedScenario) -> TrialRun:
        """Cancel all earlier runs, start a run in a thread, and return the new run."""
        with self._start_lock:
            for trial in self._trials:
                trial.is_canceled = True
            self._folder = self._folder or Path(tempfile.mkdtemp(prefix="simscen-edit-"))
            number = len(self._trials) + 1
            trial = TrialRun(number, self._folder / str(number), loaded.spec.time_limit)
            self._trials.append(trial)
        threading.Thread(target=self._run, args=(loaded, trial), daemon=True).start()
        return trial

    def trial(self, number: int) -> TrialRun | None:
        """Return the run with this number; None if there is no such run."""
        return self._trials[number - 1] if 0 < number <= len(self._trials) else None

    def close(self) -> None:
        """Cancel all runs and delete their files."""
        for trial in self._trials:
            trial.is_canceled = True
        has_ended = self._run_lock.acquire(timeout=STOP_TIMEOUT_S)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        if has_ended:
            self._run_lock.release()

    def _run(self, loaded: LoadedScenario, trial: TrialRun) -> None:
        """Wait for earlier runs, simulate a scenario, and write progress and result to `trial`."""

        def listen(event: SessionEvent) -> None:
            if trial.is_canceled:
                raise _Canceled
            if isinstance(event, RunProgress):
                trial.seconds = event.simulated

        job = Job(0, loaded, loaded.key(loaded.spec.seed), trial.folder, WALL_LIMIT_S, OutcomeFilter.ALL)
        try:
            with self._run_lock:
                if trial.is_canceled:
                    raise _Canceled
                with self._backend_factory() as backend:
                    answers, _ = run_session([job], SessionOptions(), backend, listen)
            self._finish(trial, answers[0].result)
        except _Canceled:
            trial.state, trial.message = "canceled", "the run was stopped"
        except (SimscenError, OSError) as error:
            trial.state, trial.message = "error", one_line(str(error))
        except Exception as error:
            traceback.print_exc()
            message = f"internal error: {type(error).__name__}; this is a bug in simscen"
            trial.state, trial.message = "error", message

    def _finish(self, trial: TrialRun, result: RunResult) -> None:
        for verdict, line in result.verdicts_with_lines:
            finding = verdict.tightest
            text = "" if finding is None else f"{one_line(finding.measured)} (limit {one_line(finding.limit)})"
            status = verdict.status.value
            trial.verdicts.append({"id": one_line(verdict.id), "status": status, "text": text, "line": line})
        trial.message = one_line(result.error.message if result.error else result.ended)
        trial.seconds = result.simulated
        trial.state = result.outcome.value  # last, because the page then shows the result
