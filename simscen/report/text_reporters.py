"""A session as it is told to people, event by event; its end says once more what matters most."""

from collections import Counter
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Protocol, TextIO

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.comparison import comparison_lines
from simscen.report.display_text import ascii_only, escape_ci_commands, one_line
from simscen.report.session_lines import (
    RunNaming,
    failed_runs,
    interruption_lines,
    log_comparison,
    run_lines,
    session_footer,
    session_header,
    slowest_runs,
)
from simscen.report.styled_line import (
    StyledLine,
    StyledText,
    TerminalStyle,
    can_encode,
    plain_text,
    wrap_line,
)

INTERRUPTED, NOT_RUN = "interrupted", "not-run"
"""Kinds of runs that were not done. One by one they would bury what was."""


class SessionFormatter:
    """Turns events into lines. `slow` is how many of the slowest runs its end lists; 0 = all.

    `columns` says how wide the terminal is now, None for no limit.
    """

    def __init__(self, slow: int | None = None, columns: Callable[[], int | None] = lambda: None) -> None:
        self.naming = RunNaming()
        self._slow, self._columns = slow, columns
        self._runs: list[RunFinished] = []
        self._warned: set[str] = set()

    def __call__(self, event: SessionEvent) -> list[StyledLine]:
        """What the event is worth."""
        return [part for line in self._lines(event) for part in wrap_line(line, self._columns())]

    def _lines(self, event: SessionEvent) -> Iterator[StyledLine]:
        match event:
            case SessionStarted():
                self.naming = RunNaming.of(event, self._columns())
                yield session_header(event)
            case RunFinished():
                self._runs.append(event)
                if _error_kind(event) not in (INTERRUPTED, NOT_RUN):
                    yield from run_lines(event, self.naming)
                    yield from self._new_warnings(event)
            case SessionFinished():
                yield from self._end(event)
            case RunStarted() | RunProgress():
                pass

    def _new_warnings(self, run: RunFinished) -> Iterator[StyledLine]:
        """Warnings of the external stack, each once in a session."""
        for text in run.warnings:
            if text not in self._warned:
                self._warned.add(text)
                yield (StyledText(f"      warning: {one_line(text)}", "odd"),)

    def _end(self, event: SessionFinished) -> Iterator[StyledLine]:
        kinds = Counter(_error_kind(run) for run in self._runs)
        if event.interrupted:
            yield from interruption_lines(event, {"under way": kinds[INTERRUPTED], "not begun": kinds[NOT_RUN]})
            return
        if event.comparison is not None:
            yield from comparison_lines(event.comparison, self.naming.prefix, self._columns())
        done = [run for run in self._runs if _error_kind(run) != NOT_RUN]
        slow = [] if self._slow is None else list(slowest_runs(done, self._slow, self._name))
        sections = [section for section in (slow, list(failed_runs(done, self._name))) if section]
        for section in sections:
            yield from ((), *section)
        yield from ((),) if sections else ()
        yield from log_comparison(done)
        yield from session_footer(event, {"not run": kinds[NOT_RUN]})

    def _name(self, key: RunKey) -> str:
        return self.naming.name(key).rstrip()


def _error_kind(run: RunFinished) -> str:
    return run.result.error.kind if run.result.error else ""


class Reporter(Protocol):
    """Listens to a session; a context, so that a terminal is left as it was whatever happens."""

    def __call__(self, event: SessionEvent) -> None:
        """Take one event."""
        ...

    def __enter__(self) -> "Reporter":
        """Begin."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        ...


class PlainReporter:
    """Each line as it happens: no color, no cursor movement, ASCII where the stream knows no more."""

    def __init__(self, out: TextIO, look: TerminalStyle, slow: int | None = None) -> None:
        self._out = out
        self._telling = SessionFormatter(slow, lambda: look.columns)
        self._ascii = not can_encode(out)

    def __enter__(self) -> "PlainReporter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Print what the event is worth."""
        for line in self._telling(event):
            self._print(line)
        self._out.flush()

    def _print(self, line: StyledLine) -> None:
        text = escape_ci_commands(plain_text(line))
        self._out.write(f"{ascii_only(text) if self._ascii else text}\n")
