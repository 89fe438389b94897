"""A session as it is told to people, event by event; its end says once more what matters most."""

from collections import Counter
from collections.abc import Callable, Iterator

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.compared import compared
from simscen.report.line import Line, Piece
from simscen.report.lines import Naming, closing, finished, opening
from simscen.report.recap import again, equal_logs, interrupted, slowest
from simscen.report.text import one_line
from simscen.report.wrap import wrapped

UNDER_WAY, NOT_BEGUN = "interrupted", "not-run"
"""Kinds of runs that were not done. One by one they would bury what was."""


class Telling:
    """Turns events into lines. `slow` is how many of the slowest runs its end lists; 0 = all.

    `columns` says how wide the terminal is now, None for no limit.
    """

    def __init__(self, slow: int | None = None, columns: Callable[[], int | None] = lambda: None) -> None:
        self.naming = Naming()
        self._slow, self._columns = slow, columns
        self._runs: list[RunFinished] = []
        self._warned: set[str] = set()

    def __call__(self, event: SessionEvent) -> list[Line]:
        """What the event is worth."""
        return [part for line in self._lines(event) for part in wrapped(line, self._columns())]

    def _lines(self, event: SessionEvent) -> Iterator[Line]:
        match event:
            case SessionStarted():
                self.naming = Naming.of(event, self._columns())
                yield opening(event)
            case RunFinished():
                self._runs.append(event)
                if _kind(event) not in (UNDER_WAY, NOT_BEGUN):
                    yield from finished(event, self.naming)
                    yield from self._new_warnings(event)
            case SessionFinished():
                yield from self._end(event)
            case RunStarted() | RunProgress():
                pass

    def _new_warnings(self, run: RunFinished) -> Iterator[Line]:
        """Warnings of the external stack, each once in a session."""
        for text in run.warnings:
            if text not in self._warned:
                self._warned.add(text)
                yield (Piece(f"      warning: {one_line(text)}", "odd"),)

    def _end(self, event: SessionFinished) -> Iterator[Line]:
        kinds = Counter(_kind(run) for run in self._runs)
        if event.interrupted:
            yield from interrupted(event, {"under way": kinds[UNDER_WAY], "not begun": kinds[NOT_BEGUN]})
            return
        if event.comparison is not None:
            yield from compared(event.comparison, self.naming.prefix, self._columns())
        done = [run for run in self._runs if _kind(run) != NOT_BEGUN]
        slow = [] if self._slow is None else list(slowest(done, self._slow, self._name))
        sections = [section for section in (slow, list(again(done, self._name))) if section]
        for section in sections:
            yield from ((), *section)
        yield from ((),) if sections else ()
        yield from equal_logs(done)
        yield from closing(event, {"not run": kinds[NOT_BEGUN]})

    def _name(self, key: RunKey) -> str:
        return self.naming.name(key).rstrip()


def _kind(run: RunFinished) -> str:
    return run.result.error.kind if run.result.error else ""
