"""`--format json`: one document on stdout when all is over, the same as results.json; nothing else."""

from types import TracebackType
from typing import TextIO

from simscen.core.records.session_events import RunFinished, SessionEvent, SessionFinished
from simscen.report.plain import Reporter
from simscen.report.results import to_json
from simscen.report.text import no_marker_in_json


def json_reporter(out: TextIO) -> Reporter:
    """Collects the runs and writes them at the end of the session."""
    return _Json(out)


class _Json:
    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._runs: list[RunFinished] = []

    def __enter__(self) -> "_Json":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Keep, or write."""
        if isinstance(event, RunFinished):
            self._runs.append(event)
        if isinstance(event, SessionFinished):
            self._out.write(no_marker_in_json(to_json(self._runs, event.folder, event.comparison)))
            self._out.flush()
