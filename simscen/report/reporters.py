"""Reporters, which print or write the events of a session: base class, plain text, and JSON."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import TextIO

from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import RunFinished, SessionEvent, SessionFinished
from simscen.report.display_text import (
    StyledLine,
    TerminalStyle,
    ascii_only,
    can_encode,
    encodable_json,
    escape_ci_commands,
    escape_ci_markers_in_json,
    plain_text,
    wrap_line,
)
from simscen.report.results_json import json_parts
from simscen.report.session_formatter import SessionFormatter


class Reporter(ABC):
    """Prints or writes the events of a session. A reporter is also a context manager, to restore the terminal."""

    @abstractmethod
    def __call__(self, event: SessionEvent) -> None:
        """Print or write one event. Events come in the order in which they happen."""

    def __enter__(self) -> "Reporter":
        """Prepare the output before the first event."""
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027 (most reporters have nothing to restore)
        """Restore the terminal."""


class PlainReporter(Reporter):
    """Prints lines without color and cursor movement, in ASCII if the stream supports nothing else.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list).
    """

    def __init__(self, out: TextIO, style: TerminalStyle, slow: int | None = None) -> None:
        self._out, self._style = out, style
        self._formatter = SessionFormatter(slow, lambda: style.columns)
        self._ascii = not can_encode(out)

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


class JsonReporter(Reporter):
    """Reporter that writes results.json to `out` at the end of the session."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._runs = RunStore()

    def __call__(self, event: SessionEvent) -> None:
        """Collect a finished run, or write the document at the end of the session."""
        if isinstance(event, RunFinished):
            self._runs.append(event)
        if isinstance(event, SessionFinished):
            for part in json_parts(self._runs, event.folder, event.comparison, event.study):
                self._out.write(encodable_json(escape_ci_markers_in_json(part), self._out))
            self._out.flush()
