"""Reporter, the interface of all reporters, and PlainReporter, which prints session events as lines of plain text."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Protocol, TextIO

from simscen.core.records.run_result import RunKey
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.comparison import comparison_lines
from simscen.report.display_text import (
    StyledLine,
    StyledText,
    TerminalStyle,
    ascii_only,
    can_encode,
    escape_ci_commands,
    one_line,
    plain_text,
    wrap_line,
)
from simscen.report.session_lines import (
    RunNaming,
    determinism_lines,
    failure_lines,
    interruption_lines,
    run_lines,
    session_footer,
    session_header,
    slowest_run_lines,
)
from simscen.report.study import study_lines

INTERRUPTED, NOT_RUN = "interrupted", "not-run"
"""Error kinds of runs that were not finished. These runs are not printed, only counted at the end."""


class SessionFormatter:
    """Formats the events of a session, in order, as console lines with styles.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list). `columns` returns the current
    width of the terminal, or None for no limit.
    """

    def __init__(self, slow: int | None = None, columns: Callable[[], int | None] = lambda: None) -> None:
        self.naming = RunNaming()
        self._slow, self._columns = slow, columns
        self._runs = RunStore()
        self._warned: set[str] = set()

    def __call__(self, event: SessionEvent) -> list[StyledLine]:
        """Return the lines for an event, wrapped to the width of the terminal."""
        return [part for line in self._lines(event) for part in wrap_line(line, self._columns())]

    def _lines(self, event: SessionEvent) -> Iterator[StyledLine]:
        match event:
            case SessionStarted():
                self.naming = RunNaming.for_session(event, self._columns())
                yield session_header(event)
            case RunFinished():
                self._runs.append(event)
                if _error_kind(event) not in (INTERRUPTED, NOT_RUN):
                    yield from run_lines(event, self.naming)
                    yield from self._new_warnings(event)
            case SessionFinished():
                yield from self._final_lines(event)
            case RunStarted() | RunProgress():
                pass

    def _new_warnings(self, run: RunFinished) -> Iterator[StyledLine]:
        """Yield the warnings of the external stack in this run that did not occur in earlier runs of the session."""
        for text in run.warnings:
            if text not in self._warned:
                self._warned.add(text)
                yield (StyledText(f"      warning: {one_line(text)}", "warning"),)

    def _final_lines(self, event: SessionFinished) -> Iterator[StyledLine]:
        kinds = Counter(_error_kind(run) for run in self._runs)
        if event.interrupted:
            yield from interruption_lines(event, {"unfinished": kinds[INTERRUPTED], "not started": kinds[NOT_RUN]})
            return
        if event.comparison is not None:
            yield from comparison_lines(event.comparison, self.naming.prefix, self._columns())
        done = self._runs.select(index for index, run in enumerate(self._runs) if _error_kind(run) != NOT_RUN)
        slow = [] if self._slow is None else list(slowest_run_lines(done, self._slow, self._name))
        sections = [section for section in (slow, list(failure_lines(done, self._name))) if section]
        for section in sections:
            yield from ((), *section)
        if event.study is not None:
            yield from study_lines(event.study)
        yield from ((),) if sections or event.study is not None else ()
        yield from determinism_lines(done)
        yield from session_footer(event, {"not run": kinds[NOT_RUN]})

    def _name(self, key: RunKey) -> str:
        return self.naming.name(key).rstrip()


def _error_kind(run: RunFinished) -> str:
    """Return the kind of the error of a run; "" without an error."""
    return run.result.error.kind if run.result.error else ""


class Reporter(Protocol):
    """Prints or writes the events of a session. A reporter is also a context manager, to restore the terminal."""

    def __call__(self, event: SessionEvent) -> None:
        """Print or write one event. Events come in the order in which they happen."""
        ...

    def __enter__(self) -> "Reporter":
        """Prepare the output before the first event."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Flush the output and restore the terminal."""
        ...


class PlainReporter:
    """Prints lines without color and cursor movement, in ASCII if the stream supports nothing else.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list).
    """

    def __init__(self, out: TextIO, style: TerminalStyle, slow: int | None = None) -> None:
        self._out, self._style = out, style
        self._formatter = SessionFormatter(slow, lambda: style.columns)
        self._ascii = not can_encode(out)

    def __enter__(self) -> "PlainReporter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Print the lines for an event."""
        for line in self._formatter(event):
            self._print(line)
        self._out.flush()

    def print_lines(self, lines: Iterable[StyledLine]) -> None:
        """Print lines that do not belong to an event, wrapped to the width of a terminal."""
        for line in lines:
            for part in wrap_line(line, self._style.columns):
                self._print(part)
        self._out.flush()

    def _print(self, line: StyledLine) -> None:
        text = escape_ci_commands(plain_text(line))
        self._out.write(f"{ascii_only(text) if self._ascii else text}\n")
